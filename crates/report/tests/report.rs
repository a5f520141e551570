//! Reports as files: escaped, complete, and refused where they have nothing to show.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use dynaskin_report::{Curve, Picture, Plot, Report, ReportError, Table, Triangle};

fn plot(points: Vec<(f64, f64)>) -> Plot {
    Plot {
        title: "Ringing <after> a push".to_owned(),
        x_label: "time (s)".to_owned(),
        y_label: "displacement (mm)".to_owned(),
        curves: vec![Curve {
            name: "chest & belly".to_owned(),
            points,
        }],
    }
}

#[test]
fn a_report_is_one_page_with_its_text_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    let mut report = Report::new("Female <body>");
    report.section("Values");
    let mut table = Table::new(["region", "Hz"]);
    table.row(vec!["chest".to_owned(), "4.4".to_owned()]);
    table.marked_row(vec!["belly".to_owned(), "−0.5".to_owned()]);
    table.row(vec!["50002_hop".to_owned(), "0.1".to_owned()]);
    report.table(&table);
    report
        .plot(&plot(vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, -3.0)]))
        .unwrap();
    report.write(&path).unwrap();
    let html = std::fs::read_to_string(&path).unwrap();
    assert!(
        html.contains("<title>Female &lt;body&gt;</title>"),
        "{html}"
    );
    assert!(html.contains("<td class=\"number\">4.4</td>"));
    assert!(html.contains("belly</td><td class=\"number\">−0.5</td>"));
    assert!(html.contains(">50002_hop</td>") && !html.contains("number\">50002_hop"));
    assert_eq!(html.matches("class=\"marked\"").count(), 1, "{html}");
    assert!(html.contains("<svg") && html.contains("displacement (mm)"));
    assert!(html.contains("chest &amp; belly") && !html.contains("NaN"));
    // No temporary file stays behind.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_plot_without_points_and_a_folder_that_is_none_are_named() {
    let error = Report::new("x")
        .plot(&plot(vec![(f64::NAN, 1.0)]))
        .unwrap_err();
    assert!(matches!(error, ReportError::Plot { .. }));
    assert!(error.to_string().contains("Ringing"), "{error}");
    let path = std::path::Path::new("no-such-folder").join("report.html");
    let error = Report::new("x").write(&path).unwrap_err();
    assert!(error.to_string().contains("no-such-folder"), "{error}");
}

#[test]
fn a_constant_curve_is_drawn() {
    Report::new("x")
        .plot(&plot(vec![(0.0, 2.0), (1.0, 2.0)]))
        .unwrap();
}

#[test]
fn pictures_are_part_of_the_page_and_empty_ones_are_named() {
    let triangle = Triangle {
        corners: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        colour: [10, 20, 30],
    };
    let picture = |triangles| Picture {
        size: (40, 30),
        triangles,
        window: None,
    };
    let mut report = Report::new("x");
    report
        .pictures(&[("truth & error".to_owned(), picture(vec![triangle]))])
        .unwrap();
    report.heat_scale("0 mm", "20 mm");
    let html = report.html();
    assert!(html.contains("data:image/png;base64,iVBOR"), "{html}");
    assert!(html.contains("truth &amp; error") && html.contains("20 mm"));
    let error = report
        .pictures(&[("nothing".to_owned(), picture(Vec::new()))])
        .unwrap_err();
    assert!(matches!(error, ReportError::Picture { .. }), "{error}");
    assert!(error.to_string().contains("nothing"), "{error}");
}
