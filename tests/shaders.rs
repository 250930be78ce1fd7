//! Every assembled shader, without a GPU: it parses and validates, its structures lie as in Rust, its
//! bindings are those of `gpu::kernel::binding`, and it stays within what every adapter has.

use isoforge::extract::Normals;
use isoforge::field::user::UserField;
use isoforge::field::{Field, PARAMETER_VECTORS, Sense, Wgsl, named};
use isoforge::gpu::kernel::{binding, parse};
use isoforge::gpu::{Form, MESH_HEADER_BYTES};
use isoforge::refine::{Counted, Refining};
use isoforge::stage::classify::BrickRecord;
use isoforge::stage::method::{Method, Placement};
use isoforge::stage::params::{Call, Uniform, Work};
use isoforge::stage::scan::Scanned;
use isoforge::stage::shaders::{self, Samples};
use isoforge::volume::Scalar;
use naga::proc::Layouter;
use naga::valid::ModuleInfo;
use naga::{AddressSpace, Module, TypeInner};

/// Fields of every kind: named, and users' without a gradient, with loops, helpers, constants, structures and
/// names that the library uses.
fn fields() -> Vec<(String, Wgsl)> {
    let users = [
        ("plain", "fn density(p: vec3<f32>) -> f32 { return p.x; }"),
        (
            "loops",
            "fn density(p: vec3<f32>) -> f32 {
                var s = 0.0;
                for (var i = 0; i < 4; i++) { var t = p.y; while t < 1.0 { t += 0.3; } s += t; }
                loop { s *= 0.5; continuing { s -= 0.1; break if s < 1.0; } }
                switch i32(p.z) { case 1: { loop { if s > 0.0 { break; } s += 1.0; } } default: {} }
                return s;
            }",
        ),
        (
            "names of ours",
            "struct Params { work: f32, iso: f32 }
            struct BrickRecord { rows: array<f32, 3> }
            const params = 1.5;
            const MAX_GROUPS = 2;
            fn is_inside(slots: Params) -> f32 { return slots.work + slots.iso; }
            fn sin_turns(vertices: f32) -> f32 { return vertices; }
            fn report_runaway() -> f32 { return 1.0; }
            fn density_gradient(records: f32) -> f32 { return records; }
            fn density(samples: vec3<f32>) -> f32 {
                var work = BrickRecord(array<f32, 3>(samples.x, samples.y, samples.z));
                let header = is_inside(Params(work.rows[1], params));
                return sin_turns(header) + report_runaway() + density_gradient(f32(MAX_GROUPS));
            }",
        ),
    ];
    let named = named::ALL.iter().map(|d| {
        let field = named::Named::new(d.name).unwrap();
        (d.name.to_string(), field.wgsl().unwrap())
    });
    let users = users.into_iter().map(|(name, source)| {
        let field = UserField::new(source, name, Sense::Below).unwrap_or_else(|e| panic!("{e}"));
        // As they are written: as expressions they are like the named ones.
        (format!("user: {name}"), field.as_written().wgsl().unwrap())
    });
    // One that reads data.
    let reads = isoforge::field::Wgsl {
        value: "fn density(p: vec3<f32>) -> f32 { return bitcast<f32>(field_data[u32(p.x)]); }".into(),
        gradient: None,
        interval: None,
        planes: None,
        data: [1].into(),
        parameters: Vec::new(),
        counts_loops: false,
    };
    named.chain(users).chain([("data".to_string(), reads)]).collect()
}

/// Name, source, module and analysis of every shader.
fn all() -> Vec<(String, Module, ModuleInfo)> {
    let mut sources = vec![
        ("normals".to_string(), shaders::normals()),
        ("components".into(), shaders::components()),
        ("refine start".into(), shaders::refine_start()),
        ("refine edges".into(), shaders::refine_edges()),
        ("refine marks".into(), shaders::refine_marks()),
        ("refine tasks".into(), shaders::refine_tasks()),
        ("refine cut".into(), shaders::refine_cut()),
        ("track, volume".into(), shaders::track(Some(Scalar::F32))),
        ("track, field".into(), shaders::track(None)),
    ];
    for form in Form::ALL {
        sources.extend([
            (format!("scan of the map, {form:?}"), shaders::scan(Scanned::Map, form)),
            (format!("scan of bricks, {form:?}"), shaders::scan(Scanned::Bricks, form)),
            (format!("scan of counts, {form:?}"), shaders::scan(Scanned::Counts, form)),
        ]);
    }
    for scalar in [Scalar::U8, Scalar::I8, Scalar::U16, Scalar::I16, Scalar::F32] {
        let samples = Samples::Volume(scalar);
        sources.push((format!("cull, volume of {scalar}"), shaders::cull(samples)));
        for form in Form::ALL {
            let name = format!("volume of {scalar}, {form:?}");
            for method in Method::ALL {
                let name = format!("{name}, {method:?}");
                sources.push((format!("classify, {name}"), shaders::classify(samples, method, form)));
                let source = shaders::emit(samples, method, Placement::Linear, Normals::Exact, form);
                sources.push((format!("emit, {name}"), source));
            }
        }
    }
    for (name, wgsl) in fields() {
        let samples = Samples::Field(&wgsl);
        sources.push((format!("cull, {name}"), shaders::cull(samples)));
        sources.push((format!("sample, {name}"), shaders::sample(&wgsl)));
        sources.extend(shaders::bounds(&wgsl).map(|source| (format!("bounds, {name}"), source)));
        sources.push((format!("refine place, {name}"), shaders::refine_place(&wgsl)));
        for form in Form::ALL {
            let planes = shaders::sample_planes(&wgsl, form);
            sources.extend(planes.map(|source| (format!("sample by planes, {name}, {form:?}"), source)));
            for method in Method::ALL {
                let source = shaders::classify(samples, method, form);
                sources.push((format!("classify, {name}, {method:?}, {form:?}"), source));
            }
            if shaders::classify_samples(&wgsl, Method::MarchingCubes, form) {
                for is_aligned in [false, true] {
                    let source = shaders::classify_sampling(&wgsl, form, is_aligned);
                    sources.push((format!("classify and sample, {name}, {form:?}, {is_aligned}"), source));
                }
            }
        }
        for (normals, form) in [
            (Normals::Exact, Form::Serial),
            (Normals::Exact, Form::Shared),
            (Normals::Forward { delta: None }, Form::Serial),
            (Normals::Central { delta: None }, Form::Shared),
        ] {
            for method in Method::ALL {
                let placements =
                    [Placement::Linear, Placement::Midpoint, Placement::Snapped { epsilon: 1.0 }];
                for placement in placements {
                    let source = shaders::emit(samples, method, placement, normals, form);
                    sources.push((
                        format!("emit {normals:?}, {placement:?}, {name}, {method:?}, {form:?}"),
                        source,
                    ));
                }
            }
        }
    }
    let parsed = sources.into_iter().map(|(name, source)| match parse(&source) {
        Ok((module, info)) => (name, module, info),
        Err(e) => panic!("{name}: {e}"),
    });
    parsed.collect()
}

/// Goes red when any shader uses a word that WGSL reserves, or a name twice.
#[test]
fn every_shader_is_valid() {
    let all = all();
    let entries: Vec<&str> =
        all.iter().flat_map(|(_, m, _)| &m.entry_points).map(|e| e.name.as_str()).collect();
    for entry in [
        "range",
        "cull",
        "keep_all",
        "arrange",
        "narrow",
        "dispatch_boxes",
        "sample",
        "classify",
        "reduce",
        "scan_partials",
        "apply",
        "emit_vertices",
        "emit_indices",
        "totals",
        "arrange",
        "add_neighbours",
        "average",
        "begin",
        "advance",
        "spread",
        "label",
        "hook",
        "jump",
        "keep",
        "mark",
        "gather",
        "inspect_vertices",
        "inspect_triangles",
        "keep_proper",
        "find_longest",
        "start_tasks",
        "count_fans",
        "fill_fans",
        "sort_fans",
        "measure",
        "close",
        "count_parts",
        "middle_tasks",
        "place",
        "find_bad",
        "find_bad_start",
        "take_back",
        "cut",
    ] {
        assert!(entries.contains(&entry), "{entry}");
    }
}

/// Name and offset of every member of a structure, and its size.
fn layout(module: &Module, name: &str) -> Option<(Vec<(String, usize)>, usize)> {
    let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name))?;
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no structure") };
    let members = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect();
    Some((members, *span as usize))
}

macro_rules! members {
    ($of:ty: $($field:ident)*) => {
        (vec![$((stringify!($field).to_string(), std::mem::offset_of!($of, $field))),*], size_of::<$of>())
    };
}

/// Goes red when two members of `Params` change places in `shaders/shared/params.wgsl` alone.
#[test]
fn structures_lie_as_in_rust() {
    let params = members!(Uniform: origin delta step_x mirrored step_y first_triangle step_z triangle_window outward_x
        vertex_window outward_y neighbour_window outward_z neighbour_capacity points own_bricks slab_first slab_bricks
        slab_extent margin source_first nothing source_extent unused_c first_vertices);
    let call =
        members!(Call: iso iso_key flip outward_sign first_slot vertex_capacity triangle_capacity epsilon);
    let work = members!(Work: active_bricks own_active vertices triangles non_finite runaway batch_slots batches
            run_slots run_vertices singular queued taken rounds slots needed_slots large_boxes small_boxes);
    let record = members!(BrickRecord: rows planes triangles);
    let refining = members!(Refining: low delta high iso near sign slope epsilon longest flatness least has_border
        nothing twice vertices triangles first tasks);
    let counted = members!(Counted: changed bent crowded cut_short runaway not_converged singular astray taken_back
        improper not_finite without_normal bad_triangle);
    for (expected, name, least) in [
        (params, "Params", 20),
        (call, "Call", 20),
        (work, "Work", 20),
        (record, "BrickRecord", 10),
        (refining, "Refining", 20),
        (counted, "Counted", 20),
    ] {
        let all = all();
        // The prefix of users' own structures keeps them apart from ours.
        let found: Vec<_> =
            all.iter().filter_map(|(shader, m, _)| Some((shader, layout(m, name)?))).collect();
        assert!(found.len() >= least, "{name} is in {} shaders", found.len());
        for (shader, layout) in found {
            assert_eq!(layout, expected, "{name} in {shader}");
        }
    }
}

/// Goes red when `write_planes` (src/graph/wgsl.rs) leaves a number out of the bytes.
#[test]
fn parts_of_fields_have_the_bytes_that_they_tell() {
    let fields = fields().into_iter().filter_map(|(name, wgsl)| Some((name, wgsl.planes.clone()?, wgsl)));
    let mut found = 0;
    for (name, planes, wgsl) in fields {
        let source = shaders::sample_planes(&wgsl, Form::Shared).unwrap();
        let module = naga::front::wgsl::parse_str(&source).unwrap();
        for (ty, bytes) in ["DensityPlane", "DensityLevel"].into_iter().zip(planes.bytes) {
            assert_eq!(layout(&module, ty).unwrap().1, bytes as usize, "{ty} of {name}");
            found += 1;
        }
    }
    assert!(found >= 10, "{found}");
}

fn number_of(name: &str) -> Option<(usize, bool)> {
    use binding as b;
    let (number, uniform) = match name {
        "params" | "bound_params" => (b::PARAMS, true),
        "call" | "bound_call" => (b::CALL, true),
        "work" => (b::WORK, false),
        "source" => (b::SOURCE, false),
        "ranges" => (b::RANGES, false),
        "map" => (b::MAP, false),
        "boxes" => (b::BOXES, false),
        "marks" => (b::MARKS, false),
        "active_list" => (b::ACTIVE, false),
        "dispatches" => (b::DISPATCHES, false),
        "records" => (b::RECORDS, false),
        // Counts of classify become offsets by their scan; before, the tracker's queue lies there.
        "counts" | "offsets" | "queue" => (b::COUNTS, false),
        "table" => (b::TABLE, false),
        "partials" => (b::PARTIALS, false),
        "samples" => (b::SAMPLES, false),
        "vertices" => (b::VERTICES, false),
        "indices" => (b::INDICES, false),
        "header" => (b::HEADER, false),
        "field_parameters" => (b::FIELD, true),
        "field_data" => (b::FIELD_DATA, false),
        "neighbours" => (b::NEIGHBOURS, false),
        "labels" => (b::LABELS, false),
        "labelled" => (b::LABELLED, false),
        "edges" => (b::EDGES, false),
        "kept_vertices" => (b::KEPT_VERTICES, false),
        "kept_indices" => (b::KEPT_INDICES, false),
        "fans" => (b::FANS, false),
        "half_edges" => (b::HALF_EDGES, false),
        "edge_of" => (b::EDGE_OF, false),
        "lengths" | "longest" => (b::LENGTHS, false),
        "splits" => (b::SPLITS, false),
        "tasks" => (b::TASKS, false),
        "fallbacks" => (b::FALLBACKS, false),
        "states" => (b::STATES, false),
        _ => return None,
    };
    Some((number, uniform))
}

/// Goes red when a shader binds `records` at 9, say.
#[test]
fn bindings_are_the_named_ones() {
    let mut seen = vec![false; binding::COUNT];
    for (shader, module, _) in all() {
        for (_, variable) in module.global_variables.iter() {
            let Some(resource) = &variable.binding else {
                assert!(
                    matches!(variable.space, AddressSpace::WorkGroup | AddressSpace::Private),
                    "{shader}: {variable:?}"
                );
                continue;
            };
            let name = variable.name.as_deref().unwrap();
            let (number, uniform) =
                number_of(name).unwrap_or_else(|| panic!("{shader}: {name}: no such binding"));
            assert_eq!((resource.group, resource.binding), (0, number as u32), "{shader}: {name}");
            assert_eq!(variable.space == AddressSpace::Uniform, uniform, "{shader}: {name}");
            seen[number] = true;
            let mut layouter = Layouter::default();
            layouter.update(module.to_ctx()).unwrap();
            let size = u64::from(layouter[variable.ty].size);
            match name {
                // Of the marching cubes table alone, or of words of all tables.
                "table" => assert!(size == 2048 || size == 4, "{shader}: {size}"),
                "header" => assert_eq!(size, MESH_HEADER_BYTES),
                "field_parameters" => assert_eq!(size, 16 * PARAMETER_VECTORS as u64),
                _ => {}
            }
        }
    }
    assert_eq!(seen, vec![true; binding::COUNT]);
}

/// What WebGPU promises of every adapter; SwiftShader has little more.
#[test]
fn shaders_stay_within_every_adapters_limits() {
    let limits = wgpu::Limits::default();
    for (shader, module, info) in all() {
        let mut layouter = Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        for (i, entry) in module.entry_points.iter().enumerate() {
            let used = info.get_entry_point(i);
            let used = || module.global_variables.iter().filter(|(handle, _)| !used[*handle].is_empty());
            let of = |wanted: fn(&AddressSpace) -> bool| used().filter(move |(_, v)| wanted(&v.space));
            let storage = of(|space| matches!(space, AddressSpace::Storage { .. })).count() as u32;
            let name = format!("{shader}: {}", entry.name);
            assert!(storage <= limits.max_storage_buffers_per_shader_stage, "{name}: {storage} buffers");
            let shared: u32 =
                of(|space| *space == AddressSpace::WorkGroup).map(|(_, v)| layouter[v.ty].size).sum();
            assert!(shared <= limits.max_compute_workgroup_storage_size, "{name}: {shared} bytes");
            let threads: u32 = entry.workgroup_size.iter().product();
            assert!(
                (1..=limits.max_compute_invocations_per_workgroup).contains(&threads),
                "{name}: {threads}"
            );
            assert!(entry.workgroup_size[2] <= limits.max_compute_workgroup_size_z, "{name}");
        }
    }
    let numbers = [
        limits.max_storage_buffers_per_shader_stage,
        limits.max_compute_workgroup_storage_size,
        limits.max_compute_invocations_per_workgroup,
    ];
    assert_eq!(numbers, [8, 16384, 256]);
}
