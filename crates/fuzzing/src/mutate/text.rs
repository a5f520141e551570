//! Mutations of text files, word by word and line by line.

use super::Mutator;

/// Words of the formats, and numbers that are hard to read.
const WORDS: [&str; 34] = [
    "{",
    "}",
    "JOINT x",
    "ROOT",
    "End Site",
    "OFFSET",
    "CHANNELS 3",
    "Xposition",
    "Yrotation",
    "MOTION",
    "Frames:",
    "Frame Time:",
    "0.0",
    "nan",
    "inf",
    "-1e400",
    "1e8",
    "1e38",
    "-0",
    "1/2/3",
    "-1",
    "4294967296",
    "99999999999999999999",
    "f 1 2 3",
    "v 0 0 0",
    "element face 3",
    "property list uchar int vertex_indices",
    "property double x",
    "format ascii 1.0",
    "end_header",
    "\\",
    "\0",
    "\u{feff}",
    "#",
];

impl Mutator<'_> {
    /// Changes a word or a line.
    pub(super) fn text(&mut self, text: &str) -> String {
        if self.one_in(3) {
            self.lines(text)
        } else {
            self.words(text)
        }
    }

    fn lines(&mut self, text: &str) -> String {
        let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
        if lines.is_empty() {
            return WORDS[self.below(WORDS.len())].to_owned();
        }
        let (at, other) = (self.below(lines.len()), self.below(lines.len()));
        match self.below(4) {
            0 => {
                lines.remove(at);
            }
            1 => lines.insert(other, lines[at]),
            2 => lines.swap(at, other),
            _ => lines.truncate(at),
        }
        lines.concat()
    }

    fn words(&mut self, text: &str) -> String {
        let mut words: Vec<&str> = text
            .split_inclusive(|c: char| c.is_whitespace() || "(),:".contains(c))
            .collect();
        if words.is_empty() {
            return WORDS[self.below(WORDS.len())].to_owned();
        }
        let at = self.below(words.len());
        let number;
        match self.below(5) {
            0 => {
                words.remove(at);
            }
            1 => words.insert(at, words[self.below(words.len())]),
            2 => {
                number = match self.one_in(2) {
                    true => format!("{} ", self.integer()),
                    false => format!("{} ", self.float()),
                };
                words[at] = &number;
            }
            3 => {
                let end = words[at].chars().last().unwrap_or(' ');
                number = format!("{}{end}", WORDS[self.below(WORDS.len())]);
                words[at] = &number;
            }
            _ => {
                let word = words[at].trim_end();
                let mut bytes = word.as_bytes().to_vec();
                (self.raw)(&mut bytes);
                number = format!(
                    "{}{}",
                    String::from_utf8_lossy(&bytes),
                    &words[at][word.len()..]
                );
                words[at] = &number;
            }
        }
        words.concat()
    }
}
