//! The command line program; everything is in `isoforge::cli`.

fn main() {
    std::process::exit(isoforge::cli::run());
}
