//! Bones that already move the skin that the tissue moves, such as spring bones.

/// Words in names of bones that authors give tissue of their own.
const TISSUE_WORDS: [&str; 12] = [
    "breast", "bust", "boob", "oppai", "pectoral", "butt", "glute", "buttock", "胸", "乳", "尻",
    "mune",
];

/// Whether a bone's name tells that it moves a breast or a buttock.
pub fn is_tissue_bone(name: &str) -> bool {
    let name = name.to_lowercase();
    // A button is no buttock.
    TISSUE_WORDS.iter().any(|word| name.contains(word)) && !name.contains("button")
}
