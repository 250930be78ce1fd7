//! Tables.

use std::fmt::Write;
use std::time::Instant;

use isoforge::components::{OpenError, OpenOptions};

use crate::folder::{Folder, RADIUS, blob, gzip};

#[test]
fn separators_headers_and_orders() {
    let wanted = vec![blob(1.0, 2.0, 3.0, 0.5, -1.0), blob(-4.0, 5e-1, 6.0, 2.0, 1.0)];
    let folder = Folder::new();
    for table in [
        "x,y,z,radius,weight\n1,2,3,.5,-1\n-4,5e-1,6,2,1\n",
        "1,2,3,0.5,-1\n-4,0.5,6,2,1",
        "W;Z;Y;X;R\r\n-1;3;2;1;0.5\r\n1;6;.5;-4;2\r\n",
        "\u{feff}\"X\"\t\"Y\"\t\"Z\"\t\"Radius\"\t\"Weight\"\n1\t2\t3\t0.5\t-1\n-4\t0.5\t6\t2\t1\n\n",
        "# by hand\n\n  # more\n x , y , z , r , w # named\n1, 2, 3, 0.5, -1 # first\n  \n-4, 0.5, 6, 2, +1\n#end",
    ] {
        let loaded = folder.open("csv", table).unwrap();
        assert_eq!(loaded.components, wanted, "{table}");
        assert_eq!(loaded.notes, [""; 0]);
        assert_eq!(folder.open("CSV.gz", gzip(table.as_bytes())).unwrap(), loaded);
    }
}

#[test]
fn defaults_are_noted() {
    let folder = Folder::new();
    let loaded = folder.open("csv", "id,x,y,z,w\na,1,2,3,4\n").unwrap();
    assert_eq!(loaded.components, [blob(1.0, 2.0, 3.0, RADIUS, 4.0)]);
    let notes =
        ["1 other columns are not used: id", "there is no column radius: every component has radius 0.25"];
    assert_eq!(loaded.notes, notes);
    // An index column without a name, as data frames write it, at either end.
    for table in ["\tx\ty\tz\n0\t1\t2\t3\n", "x\ty\tz\t\n1\t2\t3\t\n"] {
        assert_eq!(folder.open("csv", table).unwrap().components, [blob(1.0, 2.0, 3.0, RADIUS, 1.0)]);
    }
    assert_eq!(folder.open("csv", "1,2,3").unwrap().components, [blob(1.0, 2.0, 3.0, RADIUS, 1.0)]);
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let options = OpenOptions { radius, max_bytes: None };
        let error = folder.open_with("csv", "1,2,3", &options).unwrap_err();
        assert!(matches!(error, OpenError::Radius { .. }), "{error}");
        assert!(folder.open_with("csv", "1,2,3,1", &options).is_ok());
    }
}

#[test]
fn bad_rows_are_named() {
    let folder = Folder::new();
    for (table, fault) in [
        ("x,y,z\n1,2,3\n\n# c\n4,five,6\n", ", row 5, column y: \"five\" is not a number"),
        ("x,y,z\r\n1,2,3\r\n\r\n4,5,\r\n", ", row 4, column z: \"\" is not a number"),
        ("1,b,3\n", ", row 1, column y: \"b\" is not a number"),
        ("1,2,3\n1,2,nan\n", ", row 2, column z: \"nan\" is not a finite 32-bit number"),
        ("z,y,x\n1,2,-inf\n", ", row 2, column x: \"-inf\" is not a finite 32-bit number"),
        ("1e39,2,3\n", ", row 1, column x: \"1e39\" is not a finite 32-bit number"),
        ("1,2,3,1\n1,2,3,0\n", ", row 2, column radius: \"0\" is not above 0"),
        ("x,y,z,r\n1,2,3,-2", ", row 2, column radius: \"-2\" is not above 0"),
        ("1,2,3,1e-60\n", ", row 1, column radius: \"1e-60\" is not above 0"),
        ("1,2,3,1,inf\n", ", row 1, column weight: \"inf\" is not a finite"),
        ("1,2,3\n\n1,2\n", ", row 3: 2 columns, but the first row has 3"),
        ("1,2,3\n1,2,3,4\n", ", row 2: 4 columns, but the first row has 3"),
        ("#\n1,2\n", ", row 2: 2 columns, and no header"),
        ("1 2 3\n", ", row 1: the header names no column x"),
        ("1,2,3,4,5,6\n", ", row 1: 6 columns, and no header"),
        ("x,z,r\n1,2,3\n", ", row 1: the header names no column y (it names x, z, r)"),
        ("x,y,z,r,radius\n", ", row 1: two columns are named radius or r"),
        ("1,2,3\n1,\"2,3\n4,5,6\n", ", row 2: a quotation mark is not closed"),
        ("", ": holds no component. Give rows"),
        ("# nothing\n\n", ": holds no component. Give rows"),
        ("x,y,z\n#1,2,3\n", ": holds no component: there is no row below the header"),
    ] {
        let found = folder.fault("csv", table);
        assert!(found.starts_with(fault), "{table:?}: {found}");
    }
    let found = folder.fault("csv", [b"1,2,3\n1,\xff\xfe,3\n".as_slice(), &b"9".repeat(1 << 17)].concat());
    assert!(found.starts_with(", row 2, column y: \"\u{fffd}\u{fffd}\" is not"), "{found}");
    let found = folder.fault("csv", [b"1,2,3\n".as_slice(), &b"9".repeat(1 << 17)].concat());
    assert!(found.starts_with(", row 2: the line is longer than 65536 bytes"), "{found}");
}

#[test]
fn rows_and_columns_are_fields_of_the_error() {
    let error = Folder::new().open("csv", "1,2,3\n1,2,x\n").unwrap_err();
    let OpenError::Value { number: 2, record: "row", column, found, .. } = error else { panic!("{error}") };
    assert_eq!((column.as_str(), found.as_str()), ("z", "x"));
}

#[test]
fn the_limit_is_kept() {
    let folder = Folder::new();
    let table = "1,2,3,4\n".repeat(5000);
    for (max_bytes, fits) in [(100_000, true), (99_999, false), (0, false), (19, false)] {
        let options = OpenOptions { max_bytes: Some(max_bytes), ..OpenOptions::default() };
        match folder.open_with("csv", &table, &options) {
            Ok(loaded) => {
                assert!(fits);
                assert_eq!((loaded.components.len(), loaded.components.capacity()), (5000, 5000));
            }
            Err(OpenError::TooMany { bytes, limit, .. }) => {
                assert!(!fits && limit == max_bytes && bytes == max_bytes / 20 * 20 + 20, "{bytes}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn a_million_rows() {
    let mut table = String::from("x,y,z,radius,weight\n");
    for i in 0..1_000_000 {
        writeln!(table, "{}.125,{},-{}.5e-1,0.75,-1.5", i % 1000, i / 1000, i % 77).unwrap();
    }
    let folder = Folder::new();
    let begun = Instant::now();
    let loaded = folder.open("csv", &table).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    assert_eq!(loaded.components.len(), 1_000_000);
    assert_eq!(loaded.components[123_456], blob(456.125, 123.0, -2.55, 0.75, -1.5));
    println!("{seconds:.2} s");
    assert!(seconds < 5.0, "{seconds} s");
}
