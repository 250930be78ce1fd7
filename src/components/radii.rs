//! Van der Waals radii of the elements.

use Origin::{Alvarez, Bondi};

/// Where a radius is from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Origin {
    /// A. Bondi, "van der Waals Volumes and Radii", J. Phys. Chem. 1964, 68, 441-451.
    Bondi,
    /// S. Alvarez, "A cartography of the van der Waals territories", Dalton Trans. 2013, 42, 8617-8636.
    Alvarez,
}

/// Atomic number, symbol, radius in angstrom and its origin: Bondi's for the non-metals, as molecules
/// are commonly drawn with, and Alvarez's for what Bondi lacks and for metals, of which Bondi's are too
/// small to touch their neighbours. Elements that neither has are left out.
#[rustfmt::skip]
const ELEMENTS: &[(u8, &str, f32, Origin)] = &[
    (1, "H", 1.20, Bondi),
    (2, "He", 1.40, Bondi),
    (3, "Li", 2.12, Alvarez),
    (4, "Be", 1.98, Alvarez),
    (5, "B", 1.91, Alvarez),
    (6, "C", 1.70, Bondi),
    (7, "N", 1.55, Bondi),
    (8, "O", 1.52, Bondi),
    (9, "F", 1.47, Bondi),
    (10, "Ne", 1.54, Bondi),
    (11, "Na", 2.50, Alvarez),
    (12, "Mg", 2.51, Alvarez),
    (13, "Al", 2.25, Alvarez),
    (14, "Si", 2.10, Bondi),
    (15, "P", 1.80, Bondi),
    (16, "S", 1.80, Bondi),
    (17, "Cl", 1.75, Bondi),
    (18, "Ar", 1.88, Bondi),
    (19, "K", 2.73, Alvarez),
    (20, "Ca", 2.62, Alvarez),
    (21, "Sc", 2.58, Alvarez),
    (22, "Ti", 2.46, Alvarez),
    (23, "V", 2.42, Alvarez),
    (24, "Cr", 2.45, Alvarez),
    (25, "Mn", 2.45, Alvarez),
    (26, "Fe", 2.44, Alvarez),
    (27, "Co", 2.40, Alvarez),
    (28, "Ni", 2.40, Alvarez),
    (29, "Cu", 2.38, Alvarez),
    (30, "Zn", 2.39, Alvarez),
    (31, "Ga", 2.32, Alvarez),
    (32, "Ge", 2.29, Alvarez),
    (33, "As", 1.85, Bondi),
    (34, "Se", 1.90, Bondi),
    (35, "Br", 1.85, Bondi),
    (36, "Kr", 2.02, Bondi),
    (37, "Rb", 3.21, Alvarez),
    (38, "Sr", 2.84, Alvarez),
    (39, "Y", 2.75, Alvarez),
    (40, "Zr", 2.52, Alvarez),
    (41, "Nb", 2.56, Alvarez),
    (42, "Mo", 2.45, Alvarez),
    (43, "Tc", 2.44, Alvarez),
    (44, "Ru", 2.46, Alvarez),
    (45, "Rh", 2.44, Alvarez),
    (46, "Pd", 2.15, Alvarez),
    (47, "Ag", 2.53, Alvarez),
    (48, "Cd", 2.49, Alvarez),
    (49, "In", 2.43, Alvarez),
    (50, "Sn", 2.42, Alvarez),
    (51, "Sb", 2.47, Alvarez),
    (52, "Te", 2.06, Bondi),
    (53, "I", 1.98, Bondi),
    (54, "Xe", 2.16, Bondi),
    (55, "Cs", 3.48, Alvarez),
    (56, "Ba", 3.03, Alvarez),
    (57, "La", 2.98, Alvarez),
    (58, "Ce", 2.88, Alvarez),
    (59, "Pr", 2.92, Alvarez),
    (60, "Nd", 2.95, Alvarez),
    (62, "Sm", 2.90, Alvarez),
    (63, "Eu", 2.87, Alvarez),
    (64, "Gd", 2.83, Alvarez),
    (65, "Tb", 2.79, Alvarez),
    (66, "Dy", 2.87, Alvarez),
    (67, "Ho", 2.81, Alvarez),
    (68, "Er", 2.83, Alvarez),
    (69, "Tm", 2.79, Alvarez),
    (70, "Yb", 2.80, Alvarez),
    (71, "Lu", 2.74, Alvarez),
    (72, "Hf", 2.63, Alvarez),
    (73, "Ta", 2.53, Alvarez),
    (74, "W", 2.57, Alvarez),
    (75, "Re", 2.49, Alvarez),
    (76, "Os", 2.48, Alvarez),
    (77, "Ir", 2.41, Alvarez),
    (78, "Pt", 2.29, Alvarez),
    (79, "Au", 2.32, Alvarez),
    (80, "Hg", 2.45, Alvarez),
    (81, "Tl", 2.47, Alvarez),
    (82, "Pb", 2.60, Alvarez),
    (83, "Bi", 2.54, Alvarez),
    (89, "Ac", 2.80, Alvarez),
    (90, "Th", 2.93, Alvarez),
    (91, "Pa", 2.88, Alvarez),
    (92, "U", 2.71, Alvarez),
    (93, "Np", 2.82, Alvarez),
    (94, "Pu", 2.81, Alvarez),
    (95, "Am", 2.83, Alvarez),
    (96, "Cm", 3.05, Alvarez),
    (97, "Bk", 3.40, Alvarez),
    (98, "Cf", 3.05, Alvarez),
    (99, "Es", 2.70, Alvarez),
];

/// The radius of the element with this symbol, in either case. Hydrogen's isotopes count as hydrogen.
pub(super) fn of_symbol(symbol: &str) -> Option<f32> {
    let isotope = ["D", "T"].iter().any(|isotope| symbol.eq_ignore_ascii_case(isotope));
    let symbol = if isotope { "H" } else { symbol };
    ELEMENTS.iter().find(|element| element.1.eq_ignore_ascii_case(symbol)).map(|element| element.2)
}

/// The radius of the element with this atomic number.
pub(super) fn of_number(number: u8) -> Option<f32> {
    ELEMENTS.binary_search_by_key(&number, |element| element.0).ok().map(|at| ELEMENTS[at].2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_element_up_to_xenon_once_and_in_order() {
        assert!((1..=54).eq(ELEMENTS.iter().take(54).map(|element| element.0)));
        assert!(ELEMENTS.is_sorted_by(|a, b| a.0 < b.0));
        assert!(ELEMENTS.iter().all(|element| (1.0..4.0).contains(&element.2)));
        for &(number, symbol, radius, _) in ELEMENTS {
            assert_eq!((of_symbol(symbol), of_number(number)), (Some(radius), Some(radius)));
        }
    }

    #[test]
    fn origins() {
        let count = |origin| ELEMENTS.iter().filter(|element| element.3 == origin).count();
        assert_eq!(count(Bondi), 19);
        assert_eq!((of_symbol("d"), of_symbol("FE"), of_symbol("Xx")), (Some(1.2), Some(2.44), None));
    }
}
