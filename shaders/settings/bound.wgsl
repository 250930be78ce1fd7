// The settings where they are bound. `call` travels within the commands where the device has immediates (src/gpu/settings.rs).
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(33) var<uniform> call: Call;

// Kernels that are linked for every form begin with it.
fn take_settings() {}
