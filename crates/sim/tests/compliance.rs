//! How far tissue gives way when gravity is turned, and the table of it.

#[path = "common/figure.rs"]
mod figure;

use std::cell::RefCell;
use std::fs;

use dynaskin_body::{PARTS, REGION_COUNT, Region, SHAPE_COUNT};
use dynaskin_sim::{
    COMPLIANCE_COUNT, ComplianceTable, SimSettings, TURNS, TableError, compliance_m,
};
use figure::figure;

/// Steps enough for a table; how exact they are is tested elsewhere.
fn quick() -> SimSettings {
    SimSettings {
        contact: false,
        ..SimSettings::default()
    }
}

fn of_shape(coefficient: f32, settings: &SimSettings) -> Vec<f32> {
    let mut shape = [0.0; SHAPE_COUNT];
    shape[0] = coefficient;
    compliance_m(&figure(), &shape, settings).expect("it finds rest")
}

/// The numbers of a region's part.
fn part(numbers: &[f32], region: Region, part: usize) -> &[f32] {
    let first = (region as usize * PARTS + part) * TURNS;
    &numbers[first..first + TURNS]
}

#[test]
fn deeper_and_softer_tissue_gives_way_more() {
    let settings = quick();
    let usual = of_shape(0.0, &settings);
    assert_eq!(usual.len(), REGION_COUNT * PARTS * TURNS);
    let deeper = of_shape(1.0, &settings);
    let mut softer = settings.clone();
    for tissue in &mut softer.tissues {
        tissue.shear_modulus_pa *= 0.5;
    }
    let softer = of_shape(0.0, &softer);
    let of = |numbers: &[f32]| part(numbers, Region::Belly, 0).to_vec();
    for (turn, usual) in of(&usual).into_iter().enumerate() {
        assert!(usual > 1e-4, "turn {turn}: {usual} m");
        assert!(of(&deeper)[turn] > 1.05 * usual, "turn {turn}");
        // Not twice as far: the volume term has a floor, and skin stays as it is.
        let ratio = of(&softer)[turn] / usual;
        assert!((1.1..2.1).contains(&ratio), "turn {turn}: {ratio}");
    }
}

#[test]
fn a_table_grows_where_it_stopped() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = figure();
    let make = |count: usize, settings: &SimSettings| {
        let told = RefCell::new(Vec::new());
        let table = ComplianceTable::make(&body, "abc", settings, folder.path(), count, |done| {
            told.borrow_mut().push(done);
        });
        (table.expect("a table"), told.into_inner())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread").install(|| {
        let (first, told) = make(2, &quick());
        assert_eq!(told, [0, 2]);
        let (second, told) = make(3, &quick());
        assert_eq!(told, [2, 3]);
        assert_eq!(second.rows[..2], first.rows[..]);
        let read = ComplianceTable::read(folder.path(), "abc").expect("a file");
        assert_eq!(read, Some(second));
        // With other settings everything is another matter.
        let mut stiffer = quick();
        stiffer.tissues[1].shear_modulus_pa *= 2.0;
        let (_, told) = make(1, &stiffer);
        assert_eq!(told, [0, 1]);
    });
}

#[test]
fn bad_tables_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = || ComplianceTable::read(folder.path(), "abc");
    assert_eq!(read().expect("nothing there is no error"), None);
    let path = folder.path().join(ComplianceTable::FILE_NAME);
    fs::write(&path, "{ \"rows\": ").expect("a file");
    let error = read().expect_err("half a file").to_string();
    assert!(
        error.contains("compliance.json") && error.contains("simulate again"),
        "{error}"
    );

    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    fs::remove_file(&path).expect("the file");
    let table = pool
        .expect("a thread")
        .install(|| ComplianceTable::make(&figure(), "abc", &quick(), folder.path(), 1, |_| {}));
    let mut table = table.expect("a table");
    let other = ComplianceTable::read(folder.path(), "def").expect_err("another body");
    assert!(matches!(other, TableError::OtherBody { .. }), "{other}");

    table.rows[0].metres = Some(vec![0.01; COMPLIANCE_COUNT - 1]);
    fs::write(&path, serde_json::to_string(&table).expect("JSON")).expect("a file");
    let error = read().expect_err("a number is missing").to_string();
    assert!(error.contains("row 0 should have 36"), "{error}");
}

#[test]
fn shapes_of_a_table_reach_beyond_those_of_the_clips() {
    let most = |of: &dyn Fn(usize) -> [f32; SHAPE_COUNT], count: usize| {
        (0..count)
            .map(|index| of(index)[1])
            .fold(f32::MIN, f32::max)
    };
    let table = most(&ComplianceTable::shape, 512);
    let clips = most(&dynaskin_sim::drawn_shape, dynaskin_sim::DRAWN_SHAPES);
    assert!(table > clips + 0.1 && table < 3.0, "{table} {clips}");
}
