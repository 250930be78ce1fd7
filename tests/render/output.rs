//! PNG files.
