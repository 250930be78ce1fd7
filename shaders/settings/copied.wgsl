// The settings, copied when a kernel begins: for software adapters. What lavapipe reads of a uniform within a loop it gathers once more
// in each turn, lane by lane. The other way: bound.wgsl.
@group(0) @binding(0) var<uniform> bound_params: Params;
@group(0) @binding(33) var<uniform> bound_call: Call;

var<private> params: Params;
var<private> call: Call;

fn take_settings() {
    params = bound_params;
    call = bound_call;
}
