//! Both backends stage by stage: each twin gets the bytes that the GPU left, so a difference shows in the
//! stage that makes it. [`inputs`] has what is compared, each stage's file checks the stage's rows.

#[path = "stage/classify.rs"]
mod classify;
mod common;
#[path = "stage/cull.rs"]
mod cull;
#[path = "stage/emit.rs"]
mod emit;
#[path = "stage/forms.rs"]
mod forms;
#[path = "stage/inputs.rs"]
mod inputs;
#[path = "stage/normals.rs"]
mod normals;
#[path = "stage/random.rs"]
mod random;
#[path = "stage/sample.rs"]
mod sample;
#[path = "stage/scan.rs"]
mod scan;
