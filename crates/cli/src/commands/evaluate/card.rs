//! The report's summary in the model card: a table that Markdown readers show.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::Context as _;
use dynaskin_evaluate::study::Comparison;

use super::cost::Cost;
use super::page::{Methods, SOFT, thousands};

const HEADING: &str = "## Compared with other methods";
/// What the columns are.
const ABOUT: &str = "\
Mean error over the soft vertices over that of plain skinning (static, in millimetres), on clips of the \
usual tissue that no method learned from. The clips that each learned from are not the same: those that \
are told what tissue is made of (dynaskin) learned from clips with varied tissue too, the others from \
those of the usual tissue only. Then what a method costs: trained weights; kilobytes of predictor and \
decoder, compressed with brotli; milliseconds of both for one avatar and frame, native, on the machine \
that wrote this. Written by `dynaskin evaluate --report --card`.";
/// What follows in a card that `dynaskin train` wrote.
const NEXT_HEADING: &str = "## Limits";

/// Writes the comparison into `MODEL_CARD.md` of the bundle's folder, in place of an earlier one.
pub fn write(
    folder: &Path,
    methods: &Methods,
    comparison: &Comparison,
    costs: &[Cost],
) -> anyhow::Result<()> {
    let path = folder.join("MODEL_CARD.md");
    let card = fs::read_to_string(&path)
        .with_context(|| format!("cannot read the model card {}", path.display()))?;
    let card = with_section(&card, &section(methods, comparison, costs));
    fs::write(&path, card)
        .with_context(|| format!("cannot write the model card {}", path.display()))
}

/// Heading, what the table says, and the table.
fn section(methods: &Methods, comparison: &Comparison, costs: &[Cost]) -> String {
    let sets: Vec<&str> = comparison.sets.iter().map(|set| set.set.name()).collect();
    let mut text = format!(
        "{HEADING}\n\n{ABOUT}\n\n\
         | method | {} | clips | weights | kB | ms |\n|---|{}\n",
        sets.join(" | "),
        "--:|".repeat(sets.len() + 4)
    );
    for (method, label) in methods.labels().enumerate() {
        let errors = comparison.sets.iter().map(|set| match method {
            0 => format!("{:.2} mm", set.errors[method][SOFT].mean_mm),
            _ => format!("{:.2}", set.ratio(method, SOFT)),
        });
        let errors: Vec<String> = errors.collect();
        // Static is no network.
        let cost = method.checked_sub(1).and_then(|index| costs.get(index));
        let clips = cost.and_then(|cost| cost.clips).map(thousands);
        let weights = cost.and_then(|cost| cost.parameters).map(thousands);
        let wire_kb = cost.map(|cost| format!("{:.0}", cost.wire_bytes as f64 / 1000.0));
        let native_ms = cost.map(|cost| format!("{:.2}", cost.native_ms.iter().sum::<f64>()));
        let costs = [clips, weights, wire_kb, native_ms].map(|cost| cost.unwrap_or("-".into()));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {label} | {} | {} |",
            errors.join(" | "),
            costs.join(" | ")
        );
    }
    text.push('\n');
    text
}

/// The card with this section in place of an earlier one, before the limits of the model or, where
/// there are none, at the end.
fn with_section(card: &str, section: &str) -> String {
    let mut kept = card.to_owned();
    if let Some(start) = kept.find(HEADING) {
        let after = start + HEADING.len();
        let end = kept[after..]
            .find("\n## ")
            .map_or(kept.len(), |at| after + at + 1);
        kept.replace_range(start..end, "");
    }
    match kept.find(NEXT_HEADING) {
        Some(at) => kept.insert_str(at, section),
        None => {
            kept.truncate(kept.trim_end().len());
            kept.push_str("\n\n");
            kept.push_str(section.trim_end());
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_stands_once_before_the_limits() {
        let section = |number: u32| format!("{HEADING}\n\n{number}\n\n");
        let card = "# Card\n\n## Held-out results\n\na\n\n## Limits\n\nb\n";
        let once = with_section(card, &section(1));
        assert_eq!(
            once,
            format!("# Card\n\n## Held-out results\n\na\n\n{HEADING}\n\n1\n\n## Limits\n\nb\n")
        );
        let twice = with_section(&once, &section(2));
        assert_eq!(twice, once.replace("\n1\n", "\n2\n"));
        let bare = with_section("# Card\n", &section(1));
        assert_eq!(bare, format!("# Card\n\n{HEADING}\n\n1\n"));
        assert_eq!(with_section(&bare, &section(1)), bare);
    }
}
