//! Shapes of wanted measures on the committed bodies.

mod common;

use std::sync::LazyLock;

use common::{body, glb};
use dynaskin_body::{
    BodyModel, Figure, FigureError, Figures, LARGEST_DISTANCE, SHAPE_COUNT, Trait,
};
use proptest::prelude::*;

const WEIGHT_TOLERANCE_KG: f64 = 0.05;
const STATURE_TOLERANCE_M: f64 = 0.0005;
const CHEST_TOLERANCE_CM: f64 = 0.1;
const SHARE_TOLERANCE: f64 = 0.001;
const AGE_TOLERANCE_YEARS: f64 = 0.1;

static BODIES: LazyLock<[(BodyModel, Vec<Trait>); 2]> =
    LazyLock::new(|| ["female", "male"].map(|name| (body(&glb(name)), traits(name))));

fn traits(name: &str) -> Vec<Trait> {
    let path = format!(
        "{}/../../models/{name}/traits.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    serde_json::from_slice(&text).expect("the committed traits are readable")
}

fn figures(which: usize) -> Figures<'static> {
    let (body, traits) = &BODIES[which];
    Figures::new(body, traits).expect("the committed bodies tell their measures")
}

fn distance(shape: &[f32; SHAPE_COUNT]) -> f64 {
    let squares = shape.iter().map(|beta| f64::from(*beta).powi(2));
    squares.sum::<f64>().sqrt()
}

/// A random adult: a direction on ten coefficients and a distance from the average.
fn adult() -> impl Strategy<Value = [f32; SHAPE_COUNT]> {
    let direction = prop::array::uniform10(-1.0_f32..1.0);
    (direction, 0.0_f32..2.5).prop_filter_map("no direction", |(direction, far)| {
        let length = distance(&direction) as f32;
        (length > 0.1).then(|| direction.map(|x| x * far / length))
    })
}

fn close(got: Option<f64>, wanted: Option<f64>, tolerance: f64) -> bool {
    match (got, wanted) {
        (Some(got), Some(wanted)) => (got - wanted).abs() <= tolerance,
        _ => false,
    }
}

/// Whether a body is one of those behind the shape space, in each of its measures.
fn is_common(which: usize, figure: &Figure) -> bool {
    let stature_m = figure.stature_m.unwrap_or_default();
    let growth = 100.0 * stature_m / BODIES[which].1[0].mean;
    BODIES[which].1.iter().all(|known| {
        let (value, growth) = match known.name.as_str() {
            "stature" => (100.0 * stature_m, 1.0),
            "weight" => (figure.weight_kg.unwrap_or_default(), growth.powi(3)),
            "chest" => (figure.chest_cm.unwrap_or_default(), growth),
            "muscle" => (100.0 * figure.muscle.unwrap_or_default(), 1.0),
            _ => (figure.age_years.unwrap_or_default(), 1.0),
        };
        (known.range[0] * growth..=known.range[1] * growth).contains(&value)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn weight_and_stature_of_a_random_adult_are_reached(which in 0..2_usize, shape in adult()) {
        let figures = figures(which);
        let known = figures.measure(&shape);
        prop_assume!(is_common(which, &known) && known.stature_m >= Some(1.45));
        let wanted = Figure {
            stature_m: known.stature_m,
            weight_kg: known.weight_kg,
            ..Figure::default()
        };
        let found = figures.shape_of(&wanted).expect("an adult");
        let reached = figures.measure(&found);
        prop_assert!(close(reached.weight_kg, wanted.weight_kg, WEIGHT_TOLERANCE_KG), "{reached:?}");
        prop_assert!(close(reached.stature_m, wanted.stature_m, STATURE_TOLERANCE_M), "{reached:?}");
        // The likeliest of all bodies that have them is at least as likely as the one measured.
        prop_assert!(distance(&found) <= distance(&shape) + 0.05);
    }

    #[test]
    fn all_five_measures_of_a_random_adult_are_reached(which in 0..2_usize, shape in adult()) {
        let figures = figures(which);
        let wanted = figures.measure(&shape);
        prop_assume!(is_common(which, &wanted) && wanted.stature_m >= Some(1.45));
        let reached = figures.measure(&figures.shape_of(&wanted).expect("an adult"));
        prop_assert!(close(reached.weight_kg, wanted.weight_kg, WEIGHT_TOLERANCE_KG), "{reached:?}");
        prop_assert!(close(reached.stature_m, wanted.stature_m, STATURE_TOLERANCE_M), "{reached:?}");
        prop_assert!(close(reached.chest_cm, wanted.chest_cm, CHEST_TOLERANCE_CM), "{reached:?}");
        prop_assert!(close(reached.muscle, wanted.muscle, SHARE_TOLERANCE), "{reached:?}");
        prop_assert!(close(reached.age_years, wanted.age_years, AGE_TOLERANCE_YEARS), "{reached:?}");
    }

    #[test]
    fn any_wish_gives_a_likely_body(
        which in 0..2_usize,
        stature_m in prop::option::of(1.45..=2.2),
        weight_kg in prop::option::of(30.0..=250.0),
        chest_cm in prop::option::of(60.0..=170.0),
        muscle in prop::option::of(0.0..=1.0),
        age_years in prop::option::of(18.0..=100.0),
    ) {
        let wanted = Figure { stature_m, weight_kg, chest_cm, muscle, age_years };
        let shape = figures(which).shape_of(&wanted).expect("within what can be asked for");
        prop_assert!(distance(&shape) <= LARGEST_DISTANCE + 1e-3, "{}", distance(&shape));
        let reached = figures(which).measure(&shape);
        prop_assert!(reached.weight_kg > Some(30.0), "{reached:?}");
        prop_assert!(reached.stature_m > Some(1.4), "{reached:?}");
    }
}

#[test]
fn no_wish_is_the_average_body() {
    let shape = figures(0).shape_of(&Figure::default());
    assert_eq!(shape, Ok([0.0; SHAPE_COUNT]));
}

#[test]
fn more_weight_changes_what_usually_goes_with_it() {
    let wanted = Figure {
        weight_kg: Some(74.0),
        stature_m: Some(1.66),
        ..Figure::default()
    };
    let figures = figures(0);
    let reached = figures.measure(&figures.shape_of(&wanted).expect("an adult"));
    let average = figures.measure(&[0.0; SHAPE_COUNT]);
    assert!(reached.chest_cm > average.chest_cm, "{reached:?}");
    assert!(reached.muscle < average.muscle, "{reached:?}");
}

#[test]
fn children_and_other_units_are_refused() {
    let refused = |wanted: Figure| figures(0).shape_of(&wanted).expect_err("refused");
    let of_stature = |stature_m| {
        refused(Figure {
            stature_m: Some(stature_m),
            ..Figure::default()
        })
    };
    assert_eq!(of_stature(1.2), FigureError::Child { got: 1.2 });
    assert!(of_stature(1.2).to_string().contains("adults"));
    for odd in [166.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(of_stature(odd), FigureError::Outside { .. }));
    }
    let light = refused(Figure {
        weight_kg: Some(7.0),
        ..Figure::default()
    });
    assert!(light.to_string().contains("30 to 250 kg, got 7"), "{light}");
    let young = refused(Figure {
        age_years: Some(12.0),
        ..Figure::default()
    });
    assert!(matches!(young, FigureError::Outside { name: "age", .. }));
}

#[test]
fn a_body_that_tells_nothing_is_shaped_by_coefficients_alone() {
    let body = common::tetrahedron();
    assert_eq!(
        Figures::new(&body, &[]).expect_err("nothing known"),
        FigureError::Untold
    );
}
