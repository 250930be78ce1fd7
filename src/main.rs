//! The command line program; everything is in `isoforge::cli`.

fn main() {
    // Mesa's software driver complains on standard error where this is not set, twice a run.
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: the first statement of `main`: no other thread runs that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    std::process::exit(isoforge::cli::run());
}
