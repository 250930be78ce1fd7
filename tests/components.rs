//! Files of blob components, from outside.

#[path = "components/csv.rs"]
mod csv;
#[path = "components/damage.rs"]
mod damage;
#[path = "components/folder.rs"]
mod folder;
#[path = "components/pdb.rs"]
mod pdb;
#[path = "components/ply.rs"]
mod ply;
#[path = "components/xyz.rs"]
mod xyz;
