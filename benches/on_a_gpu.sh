#!/bin/sh
# Everything that is measured and compared on a real GPU, for `benches/h200` and NOTES.md: some 70 s on a large card.
#   benches/on_a_gpu.sh target/release/isoforge OUT [SIZE [VOLUME…]]
# SIZE (512) is the cells of the larger grids; VOLUMEs are compared at iso 40. White noise and a ball as volumes are made by python3 with numpy; without it they are left out.
# Exit 1 if any comparison with the CPU fails; OUT/compare.txt tells of each whether the bytes are equal, and which outputs are not.
program=$1
out=$2
size=${3:-512}
[ -x "$program" ] && mkdir -p "$out" || { sed -n 2,5p "$0"; exit 2; }
[ $# -gt 3 ] && shift 3 || set --
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

"$program" info | tee "$out/info.txt"

bench() {
    name=$1
    shift
    "$program" bench -q --backend gpu --roofline --json "$out/$name.json" "$@" || echo "bench $name failed"
}
bench dense --dense -n "$((size / 2)),$size" --cases gyroid,sphere,torus
bench analytic -n "$((size / 2)),$size,$((2 * size)),$((4 * size))" --cases sphere,torus,gyroid
bench arrays --arrays --repeats 3 -n "$size" --cases gyroid,sphere
python3 - "$scratch" "$size" <<'P' || echo "no volumes: python3 with numpy is missing"
import sys
import numpy
folder, n = sys.argv[1], int(sys.argv[2])
axis = numpy.arange(n, dtype=numpy.float32) - 0.5 * (n - 1)
squares = axis * axis
radius = numpy.sqrt(squares[:, None, None] + squares[None, :, None] + squares[None, None, :])
numpy.clip(255 - 255 * radius / n, 0, 255).astype(numpy.uint8).tofile(f"{folder}/ball_u8.raw")
# Smaller: the vertices of 512³ of noise take more than a buffer holds.
m = 3 * n // 4
numpy.random.default_rng(1).random((m, m, m), dtype=numpy.float32).tofile(f"{folder}/noise_f32.raw")
for name, kind, n in [("ball_u8", "uint8", n), ("noise_f32", "float", m)]:
    with open(f"{folder}/{name}.nhdr", "w") as header:
        header.write(f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {n} {n} {n}\nencoding: raw\nendian: little\ndata file: {name}.raw\n")
P
[ -f "$scratch/ball_u8.nhdr" ] && bench ball_u8 -n 64 --cases sphere --volume "$scratch/ball_u8.nhdr" -I 160 --sweep 100
[ -f "$scratch/noise_f32.nhdr" ] && bench noise_f32 -n 64 --cases sphere --volume "$scratch/noise_f32.nhdr" -I 0.5 --repeats 3
for form in serial shared subgroup; do
    bench "form_$form" --form "$form" -n "$size" --cases gyroid --arrays --repeats 3
done

# The CPU's bytes, eight comparisons at a time.
begun=1000
compare() {
    begun=$((begun + 1))
    told=$scratch/told.$begun
    {
        "$program" compare "$@" >"$told" 2>&1
        code=$?
        [ $code = 0 ] || : >"$scratch/failed"
        # The verdict, and what differs in the last bits or more.
        { echo "compare $*: $code, $(tail -n 1 "$told")"; grep -E 'within|DISAGREES' "$told"; } >"$scratch/verdict.$begun"
    } &
    [ $((begun % 8)) != 0 ] || wait
}
fields=$("$program" fields | grep '^[a-z]')
for method in mc mc33 mt; do
    for field in $fields; do
        compare "$field" -n 64 --method "$method"
    done
done
compare 'sqrt(x^2 + y^2 + z^2) - 1 + 0.37 * cos(5*x) / (2 + sin(3*y))' -n 64
for volume in "$@"; do
    compare "$volume" -I 40
done
wait
cat "$scratch"/verdict.* | tee "$out/compare.txt"
[ ! -e "$scratch/failed" ]
