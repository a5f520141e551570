//! `dynaskin reproduce` on tiny models of the papers' methods and a few simulated frames.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::fs;
use std::path::Path;

use command::printed;

fn body() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb");
    path.to_str().unwrap().to_owned()
}

/// A call that has to fail and say all `words`.
fn refused(arguments: &[&str], words: &[&str]) {
    let error = command::refused(arguments);
    for word in words {
        assert!(error.contains(word), "`{word}` is missing in: {error}");
    }
}

/// The cells of the table rows of a page that hold all `words`.
fn cells(html: &str, words: &[&str]) -> Vec<String> {
    // What comes before the first row is no row.
    let row = html.split("<tr").skip(1).find(|row| {
        let text = row.split("</tr>").next().unwrap();
        words.iter().all(|word| text.contains(word))
    });
    let row = row.unwrap_or_else(|| panic!("no row of {words:?} in {html}"));
    let row = row.split("</tr>").next().unwrap();
    row.split("<td")
        .skip(1)
        .map(|cell| cell.split_once('>').unwrap().1.replace("</td>", ""))
        .collect()
}

#[test]
fn figures_of_the_papers_stand_beside_theirs() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (body, data) = (body(), path("data"));
    let clips =
        "hop-190-090__s0,shake-hips-144-040__s0,one-leg-hop-190-060__s0,jumping-jacks-090-070__s0";
    let simulate = [
        "simulate", "--body", &body, "--out", &data, "--filter", clips,
    ];
    let short = [
        "--procedural",
        "--no-mirror",
        "--shapes",
        "1",
        "--limit-frames",
        "40",
    ];
    printed(&[&simulate[..], &short].concat());
    let (casas, dsnet) = (path("casas"), path("dsnet"));
    let train = |method, out: &str, sizes: &[&str]| {
        let start = [
            "train", method, "--data", &data, "--body", &body, "--out", out,
        ];
        let epochs = [
            "--epochs",
            "1",
            "--autoencoder-epochs",
            "1",
            "--autoencoder-frames",
            "40",
        ];
        printed(&[&start[..], &epochs, sizes].concat());
    };
    let widths = ["--autoencoder-widths", "24,12,6", "--neurons", "16"];
    train("casas-otaduy", &casas, &widths);
    train("dsnet", &dsnet, &["--channels", "4", "4", "--without-body"]);

    let page = |figure: &str, more: &[&str]| {
        let out = path("pages/page.html");
        printed(&[&["reproduce", figure, "--out", &out], more].concat());
        fs::read_to_string(&out).unwrap()
    };
    let html = page("casas-fig7", &["--model", &casas, "--data", &data]);
    let paper = cells(&html, &["one leg jump", "in the paper"]);
    assert_eq!(paper[3..], ["0.400 ± 0.060", "0.510 ± 0.120", "0.78"]);
    let ours = cells(
        &html,
        &["one-leg-hop-190-060__s0", "belly", "Casas-Otaduy here"],
    );
    let number = |cell: &str| cell.split(' ').next().unwrap().parse::<f64>().unwrap();
    assert!(number(&ours[4]) > 0.0 && number(&ours[5]) > 0.0, "{ours:?}");
    // Running in place is not among the clips; its row of the paper is.
    assert!(html.contains("1.130") && !html.contains("run-in-place-"));
    assert!(html.contains("<svg") && html.contains("What differs"));

    let with_body = ["--model", &dsnet, "--body", &body, "--data", &data];
    let html = page("dsnet-fig8", &with_body);
    assert!(html.contains("0.004 (no unit)") && html.contains("one-leg-hop-190-060__s0"));
    let clip = "jumping-jacks-090-070__s0";
    let html = page("dsnet-fig8", &[&with_body[..], &["--clip", clip]].concat());
    assert!(html.contains(clip) && !html.contains("one-leg-hop-190"));

    let html = page("parameters", &["--model", &casas, "--model", &dsnet]);
    let row = cells(&html, &["Casas &amp; Otaduy, autoencoder"]);
    let bundle = fs::read_to_string(Path::new(&casas).join("bundle.json")).unwrap();
    let bundle: serde_json::Value = serde_json::from_str(&bundle).unwrap();
    let vertices = bundle["vertices"].as_array().unwrap().len();
    let layers = [3 * vertices, 24, 12, 6, 12, 24, 3 * vertices];
    let weights: usize = layers.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum();
    let told = row[4].replace(',', "").parse::<usize>().unwrap();
    assert_eq!(told, weights, "{row:?}");
    assert_eq!(row[1..3], ["284,678,770", "284,678,770"]);
    let row = cells(&html, &["DSNet, autoencoder"]);
    assert_eq!(row[1..3], ["33,626,606", "33,626,215"]);

    let csv = path("subspaces.csv");
    let rows = "hop,50,0,0.2,0.3\nhop,100,0,0.1,0.125\n";
    fs::write(
        &csv,
        format!("clip,latents,frame,autoencoder_mm,pca_mm\n{rows}"),
    )
    .unwrap();
    let html = page("casas-fig5", &["--subspaces", &csv]);
    let row = cells(&html, &["below principal components", "100 numbers"]);
    assert_eq!(row[2..], ["0.80", "yes"]);
    let row = cells(&html, &["about as good as 100"]);
    assert_eq!(row[2..], ["1.60", "no"]);

    let html = page("dsnet-table1", &["--data", &data, "--body", &body]);
    let row = cells(&html, &["here", "unseen motion"]);
    assert_eq!(row[2..5], ["1", "2", "60"]);

    let out = ["--out", "none.html"];
    let reproduce = |figure: &'static str, more: &[&str], words: &[&str]| {
        refused(&[&["reproduce", figure], &out[..], more].concat(), words);
    };
    reproduce(
        "dsnet-fig9",
        &[],
        &["dsnet-fig8", "casas-fig7", "parameters"],
    );
    let other = ["--model", &casas, "--data", &data];
    reproduce(
        "dsnet-fig8",
        &other,
        &["a bundle of casas-otaduy", "dsnet and dsnet-rbf"],
    );
    reproduce("casas-fig7", &["--data", &data], &["needs --model"]);
    reproduce("casas-fig7", &["--model", &casas], &["needs --data"]);
    reproduce("casas-fig5", &[], &["needs --subspaces"]);
    let other = ["--model", &casas, "--data", &data, "--clip", "hop__s0"];
    reproduce("casas-fig7", &other, &["no use for --clip"]);
    reproduce("parameters", &["--data", &data], &["no use for --data"]);
    let pages = tempfile::tempdir().unwrap();
    fs::write(pages.path().join("bundle.json"), "<!doctype html>").unwrap();
    let pages = pages.path().to_str().unwrap();
    let model = ["--model", pages, "--data", &data];
    reproduce("casas-fig7", &model, &[pages, "it is a web page"]);
    let folder = folder.path().to_str().unwrap();
    refused(
        &["reproduce", "parameters", "--out", folder],
        &[folder, "it is a folder"],
    );
    let learned = [&with_body[..], &["--clip", "hop-190-090__s0"]].concat();
    reproduce("dsnet-fig8", &learned, &["hop-190-090__s0 is not among"]);
    assert!(!Path::new("none.html").exists());
}
