//! Words of a BVH file with their line numbers.

use crate::MotionError;

/// Largest size of a number taken from a file: beyond it sums and products lose all meaning.
const MAX_ABS: f64 = 1e9;

/// The text of a file that begins with UTF-16's byte order mark; none for others.
pub fn utf8_from_utf16(bytes: &[u8]) -> Option<String> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => return None,
    };
    let units = bytes[2..]
        .chunks_exact(2)
        .map(|pair| unit([pair[0], pair[1]]));
    Some(
        char::decode_utf16(units)
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect(),
    )
}

/// A cursor over the bytes of the file.
pub struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line of the cursor, counted from 1.
    pub line: usize,
}

impl<'a> Text<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self {
            bytes,
            at: 0,
            line: 1,
        }
    }

    /// Passes over blank lines and lines that begin with `#`, `//` or `;`.
    pub fn skip_comments(&mut self) {
        loop {
            self.skip_blank(b' ');
            let rest = &self.bytes[self.at..];
            if ![&b"#"[..], b"//", b";"]
                .iter()
                .any(|mark| rest.starts_with(mark))
            {
                return;
            }
            while self
                .peek()
                .is_some_and(|byte| byte != b'\n' && byte != b'\r')
            {
                self.step();
            }
        }
    }

    /// Bytes not read yet.
    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Steps over one byte. A line ends with LF, CR LF or a CR alone.
    fn step(&mut self) {
        let byte = self.bytes[self.at];
        self.at += 1;
        if byte == b'\n' || (byte == b'\r' && self.peek() != Some(b'\n')) {
            self.line += 1;
        }
    }

    fn skip_blank(&mut self, also: u8) {
        while let Some(byte) = self.peek() {
            if !is_blank(byte) && byte != also {
                break;
            }
            self.step();
        }
    }

    /// The next word, or none at the end. A brace is a word of its own; the colon of the motion
    /// header separates words when `also_blank` is `b':'`.
    fn next_word(&mut self, also_blank: u8) -> Option<&'a [u8]> {
        self.skip_blank(also_blank);
        let start = self.at;
        while let Some(byte) = self.peek() {
            let is_brace = byte == b'{' || byte == b'}';
            if is_blank(byte) || byte == also_blank || (is_brace && self.at > start) {
                break;
            }
            self.step();
            if is_brace {
                break;
            }
        }
        (self.at > start).then(|| &self.bytes[start..self.at])
    }

    /// The next word; its absence is an error.
    pub fn word(&mut self, expected: &str) -> Result<&'a [u8], MotionError> {
        self.next_word(b' ').ok_or_else(|| self.truncated(expected))
    }

    /// The next word of the motion header, where colons separate.
    pub fn header_word(&mut self, expected: &str) -> Result<&'a [u8], MotionError> {
        self.next_word(b':').ok_or_else(|| self.truncated(expected))
    }

    /// The next word of the frames, or none at the end of the file.
    pub fn value_word(&mut self) -> Option<&'a [u8]> {
        self.next_word(b' ')
    }

    /// Takes the word `keyword` in any case.
    pub fn keyword(&mut self, keyword: &str) -> Result<(), MotionError> {
        let word = self.word(keyword)?;
        self.check_keyword(word, keyword)
    }

    /// Takes the word `keyword` of the motion header in any case.
    pub fn header_keyword(&mut self, keyword: &str) -> Result<(), MotionError> {
        let word = self.header_word(keyword)?;
        self.check_keyword(word, keyword)
    }

    fn check_keyword(&self, word: &[u8], keyword: &str) -> Result<(), MotionError> {
        if word.eq_ignore_ascii_case(keyword.as_bytes()) {
            Ok(())
        } else {
            Err(self.unexpected(keyword, word))
        }
    }

    /// The rest of the line, up to an opening brace, without blanks at its ends.
    pub fn rest_of_line(&mut self) -> String {
        let start = self.at;
        while let Some(byte) = self.peek() {
            if matches!(byte, b'\n' | b'\r' | b'{') {
                break;
            }
            self.step();
        }
        String::from_utf8_lossy(&self.bytes[start..self.at])
            .trim()
            .to_owned()
    }

    /// Whether nothing but blanks stands before the end of the line.
    pub fn at_line_end(&mut self) -> bool {
        while let Some(byte) = self.peek() {
            if byte == b'\n' || byte == b'\r' {
                return true;
            }
            if !is_blank(byte) {
                return false;
            }
            self.step();
        }
        true
    }

    /// Reads a finite number of moderate size.
    pub fn number(&self, word: &[u8], expected: &str) -> Result<f64, MotionError> {
        let number: f64 = std::str::from_utf8(word)
            .ok()
            .and_then(|text| text.parse().ok())
            .ok_or_else(|| self.unexpected(expected, word))?;
        if number.abs() <= MAX_ABS {
            Ok(number)
        } else {
            Err(MotionError::BadNumber {
                line: self.line,
                found: shown(word),
            })
        }
    }

    /// Reads a count, which must not be negative.
    pub fn count(&self, word: &[u8], expected: &str) -> Result<usize, MotionError> {
        std::str::from_utf8(word)
            .ok()
            .and_then(|text| text.parse().ok())
            .ok_or_else(|| self.unexpected(expected, word))
    }

    pub fn unexpected(&self, expected: &str, found: &[u8]) -> MotionError {
        MotionError::Syntax {
            line: self.line,
            expected: expected.to_owned(),
            found: shown(found),
        }
    }

    pub fn truncated(&self, expected: &str) -> MotionError {
        MotionError::Truncated {
            line: self.line,
            expected: expected.to_owned(),
        }
    }
}

/// NUL and the no-break space of Latin-1 do not count: they are signs of binary data or UTF-16.
fn is_blank(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == 0x0b
}

/// A short, printable form of a word for messages.
fn shown(word: &[u8]) -> String {
    let head = &word[..word.len().min(40)];
    let more = if word.len() > head.len() { "…" } else { "" };
    format!("`{}{more}`", head.escape_ascii())
}
