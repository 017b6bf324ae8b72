//! The words and arrays of a legacy file, one after another: text or binary, as its third line says.

use crate::error::Error;
use crate::io::data::reverse;
use crate::io::number::{Kind, Number, with_kind};
use crate::memory;
use crate::mesh::Values;

/// A place in a legacy file. Methods that cannot read on say why, as text to which the place is added.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The byte that lines end with: the last of two, or that of old Macs.
    end: u8,
    pub(super) binary: bool,
    /// What there was no memory for: then nothing of the file is of use.
    pub(super) lacking: Option<Error>,
}

/// The keywords that sections start with, and what follows them on the line: words, counts (`n`) and types (`t`).
const SECTIONS: [(&str, &str); 23] = [
    ("POINTS", "nt"),
    ("CELLS", "nn"),
    ("CELL_TYPES", "n"),
    ("DIMENSIONS", "nnn"),
    ("X_COORDINATES", "nt"),
    ("Y_COORDINATES", "nt"),
    ("Z_COORDINATES", "nt"),
    ("EXTENT", "wwwwww"),
    ("POINT_DATA", "n"),
    ("CELL_DATA", "n"),
    ("FIELD", "wn"),
    ("SCALARS", "wt"),
    ("COLOR_SCALARS", "wn"),
    ("LOOKUP_TABLE", "wn"),
    ("VECTORS", "wt"),
    ("NORMALS", "wt"),
    ("TANGENTS", "wt"),
    ("TENSORS", "wt"),
    ("TENSORS6", "wt"),
    ("TEXTURE_COORDINATES", "wnt"),
    ("GLOBAL_IDS", "wt"),
    ("PEDIGREE_IDS", "wt"),
    ("EDGE_FLAGS", "wt"),
];

/// Bytes of a line that could start a section.
const LONGEST_LINE: usize = 1 << 10;

/// What an array is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Type {
    Numbers {
        /// As the file holds them.
        stored: Kind,
        /// As they are kept.
        kept: Kind,
    },
    Bits,
    Strings,
}

impl Type {
    /// The type of that name, which is told by VTK's writer. Ids have 64 bits, of which binary files hold 32.
    pub(super) fn from_name(name: &str, binary: bool) -> Result<Type, String> {
        let kind = match name.to_ascii_lowercase().as_str() {
            "char" | "signed_char" | "vtktypeint8" => Kind::I8,
            "unsigned_char" | "vtktypeuint8" => Kind::U8,
            "short" | "vtktypeint16" => Kind::I16,
            "unsigned_short" | "vtktypeuint16" => Kind::U16,
            "int" | "vtktypeint32" => Kind::I32,
            "unsigned_int" | "vtktypeuint32" => Kind::U32,
            "long" | "vtktypeint64" => Kind::I64,
            "unsigned_long" | "vtktypeuint64" => Kind::U64,
            "float" | "vtktypefloat32" => Kind::F32,
            "double" | "vtktypefloat64" => Kind::F64,
            "vtkidtype" => {
                return Ok(Type::Numbers { stored: if binary { Kind::I32 } else { Kind::I64 }, kept: Kind::I64 });
            }
            "bit" => return Ok(Type::Bits),
            "string" => return Ok(Type::Strings),
            _ => return Err(format!("there is no number type \"{}\"", name.escape_debug())),
        };
        Ok(Type::Numbers { stored: kind, kept: kind })
    }
}

impl<'a> Scanner<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        // What comes before the first line's text is passed over, as is done where the kind of file is told.
        let bom = usize::from(bytes.starts_with(b"\xef\xbb\xbf")) * 3;
        let at = bom + bytes[bom..].iter().take_while(|b| b.is_ascii_whitespace()).count();
        let mut first = bytes[at..].iter().skip_while(|b| !matches!(b, b'\n' | b'\r'));
        let old_mac = first.next() == Some(&b'\r') && first.next() != Some(&b'\n');
        Scanner { bytes, at, end: if old_mac { b'\r' } else { b'\n' }, binary: false, lacking: None }
    }

    /// Bytes from the start of the file.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    fn skip_blanks(&mut self) {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    /// The next word; none at the end of the file.
    fn bytes_of_word(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let word = &self.rest()[..self.rest().iter().take_while(|b| !b.is_ascii_whitespace()).count()];
        self.at += word.len();
        (!word.is_empty()).then_some(word)
    }

    /// The next word, which must be there.
    pub(super) fn word(&mut self, what: &str) -> Result<String, String> {
        let word = self.bytes_of_word().ok_or_else(|| format!("the file ends before {what}"))?;
        Ok(String::from_utf8_lossy(word).into_owned())
    }

    /// Passes the next word if it is `keyword`, and says so.
    pub(super) fn pass(&mut self, keyword: &str) -> bool {
        let start = self.at + self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
        let end = start + keyword.len();
        let found = self.bytes.get(start..end).is_some_and(|word| word.eq_ignore_ascii_case(keyword.as_bytes()))
            && self.bytes.get(end).is_none_or(u8::is_ascii_whitespace);
        if found {
            self.at = end;
        }
        found
    }

    pub(super) fn count(&mut self, what: &str) -> Result<usize, String> {
        let word = self.word(what)?;
        word.parse().map_err(|_| format!("{what} is \"{}\", not a count", word.escape_debug()))
    }

    /// A count on this line, if there is one.
    pub(super) fn count_on_line(&mut self) -> Option<usize> {
        let before = self.at;
        let line = self.line();
        self.at = before;
        line.split_whitespace().next()?.parse().ok()
    }

    /// What is left of the line. The scanner goes to the start of the next one.
    pub(super) fn line(&mut self) -> String {
        let end = self.rest().iter().position(|b| *b == self.end);
        let line = &self.rest()[..end.unwrap_or(self.rest().len())];
        self.at += end.map_or(line.len(), |end| end + 1);
        String::from_utf8_lossy(line).trim().to_owned()
    }

    pub(super) fn is_at_end(&mut self) -> bool {
        self.skip_blanks();
        self.rest().is_empty()
    }

    /// Passes a description of the array before, if there is one: it ends with an empty line.
    pub(super) fn pass_metadata(&mut self) {
        while self.pass("METADATA") {
            self.pass_description();
        }
    }

    /// Passes the rest of a description.
    pub(super) fn pass_description(&mut self) {
        self.line();
        while !self.line().is_empty() {}
    }

    /// The place of the next word.
    pub(super) fn at_word(&mut self) -> usize {
        self.skip_blanks();
        self.at
    }

    /// Whether a number is next.
    pub(super) fn is_at_number(&mut self) -> bool {
        self.skip_blanks();
        let word = self.rest().split(u8::is_ascii_whitespace).next().unwrap_or_default();
        std::str::from_utf8(word).is_ok_and(|word| f64::parse(word).is_some())
    }

    /// Whether the next line starts a section.
    pub(super) fn is_at_section(&mut self) -> bool {
        self.skip_blanks();
        self.is_section(self.at)
    }

    /// Whether the next line is that before the numbers of an array of a field.
    pub(super) fn is_at_field(&mut self) -> bool {
        self.skip_blanks();
        self.is_field(self.at)
    }

    /// The words of the line at `at`, as far as they are text.
    fn words(&self, at: usize) -> impl Iterator<Item = &'a str> + use<'a> {
        let rest = &self.bytes[at..];
        let line = &rest[..rest.len().min(LONGEST_LINE)];
        let line = line.split(|b| matches!(b, b'\n' | b'\r')).next().unwrap_or_default();
        line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).map_while(|w| std::str::from_utf8(w).ok())
    }

    fn is_section(&self, at: usize) -> bool {
        let mut words = self.words(at);
        let Some(keyword) = words.next().map(str::to_ascii_uppercase) else { return false };
        if keyword == "METADATA" {
            return true;
        }
        let Some((_, shape)) = SECTIONS.iter().find(|(known, _)| *known == keyword) else { return false };
        shape.chars().all(|what| {
            words.next().is_some_and(|word| match what {
                'n' => word.parse::<u64>().is_ok(),
                't' => Type::from_name(word, self.binary).is_ok(),
                _ => true,
            })
        })
    }

    /// Whether the line at `at` is that before the numbers of an array of a field.
    fn is_field(&self, at: usize) -> bool {
        let mut words = self.words(at);
        let mut next = |fits: &dyn Fn(&str) -> bool| words.next().is_some_and(fits);
        let count = |word: &str| word.parse::<u64>().is_ok();
        let described = next(&|_| true) && next(&count) && next(&count);
        described && next(&|word| Type::from_name(word, self.binary).is_ok())
    }

    /// Goes to the first line after byte `start` that starts a section, or, in a field, an array; else to the end.
    pub(super) fn go_on(&mut self, start: usize, in_field: bool) {
        self.at = self.next_start(start, in_field).unwrap_or(self.bytes.len());
    }

    fn next_start(&self, start: usize, in_field: bool) -> Option<usize> {
        let mut at = start;
        while let Some(end) = self.bytes[at..].iter().position(|b| matches!(b, b'\n' | b'\r')) {
            at += end + 1;
            // No keyword starts with anything but a letter, which spares most lines of numbers.
            let letter = self.bytes.get(at).is_some_and(u8::is_ascii_alphabetic);
            if letter && self.is_section(at) || in_field && self.is_field(at) {
                return Some(at);
            }
        }
        None
    }

    /// Checks that an array, whose lines start at byte `start`, ends where something else starts: that it is as long as
    /// it says.
    pub(super) fn check_end(&mut self, start: usize, in_field: bool) -> Result<(), String> {
        let end = self.at;
        if self.is_at_end() || self.is_at_section() || in_field && self.is_field(self.at) {
            return Ok(());
        }
        if !self.binary {
            let over = self.is_at_number();
            return if over { Err("it holds more numbers than it should".to_owned()) } else { Ok(()) };
        }
        // Bytes that are no text belong to it; text that starts a section in the midst of it does not.
        let next = self.next_start(start, in_field);
        let word = self.rest().split(u8::is_ascii_whitespace).next().unwrap_or_default();
        let is_word = word.len() > 2 && word.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_');
        match next {
            Some(next) if next < end => Err("it holds fewer bytes than it should".to_owned()),
            _ if is_word && word[0].is_ascii_alphabetic() || self.rest().iter().all(|b| *b == 0) => Ok(()),
            _ => Err("it holds more bytes than it should".to_owned()),
        }
    }

    /// Reads as many values, which start on the next line if they are no text; none if they are strings.
    pub(super) fn values(&mut self, what: Type, count: Option<usize>) -> Result<Option<Values>, String> {
        let count = count.ok_or("there are more values than any file can hold")?;
        if what == Type::Strings {
            self.line();
        } else {
            self.enter_numbers();
        }
        Ok(match what {
            Type::Numbers { stored, kept } if stored == kept => {
                Some(with_kind!(kept, T => T::values(self.numbers::<T>(count)?)))
            }
            Type::Numbers { .. } => {
                let narrow = self.numbers::<i32>(count)?;
                self.had(memory::check_array::<i64>("an array", count))?;
                Some(Values::I64(narrow.into_iter().map(i64::from).collect()))
            }
            Type::Bits if self.binary => {
                let bytes = self.take(count.div_ceil(8))?;
                self.had(memory::check_array::<u8>("an array", count))?;
                Some(Values::U8((0..count).map(|i| bytes[i / 8] >> (7 - i % 8) & 1).collect()))
            }
            Type::Bits => Some(Values::U8(self.numbers(count)?)),
            Type::Strings => {
                for _ in 0..count {
                    self.string()?;
                }
                None
            }
        })
    }

    /// Passes a string: in text a line, else bytes after their number, of which the first two bits say how long it is
    /// itself.
    fn string(&mut self) -> Result<(), String> {
        if self.rest().is_empty() {
            return Err("the file ends inside the array".to_owned());
        }
        if self.binary {
            let size = [8, 4, 2, 1][usize::from(self.bytes[self.at] >> 6)];
            let head = self.take(size)?;
            let length =
                head.iter().fold(0u64, |n, byte| n << 8 | u64::from(*byte)) & (u64::MAX >> (66 - 8 * size as u32));
            self.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        } else {
            self.line();
        }
        Ok(())
    }

    /// Goes to where numbers start: the next line if they are no text.
    pub(super) fn enter_numbers(&mut self) {
        if self.binary {
            self.line();
        }
    }

    /// Passes the rest of the line of scalars, and the name of their table of colours if it follows.
    pub(super) fn pass_table(&mut self) -> Result<(), String> {
        let before = self.at;
        self.line();
        if self.pass("LOOKUP_TABLE") {
            self.word("the name of a table").map(drop)
        } else {
            self.at = before;
            self.count_on_line().map_or(Ok(()), |_| self.word("the number of components").map(drop))
        }
    }

    fn take(&mut self, bytes: usize) -> Result<&'a [u8], String> {
        let taken = self.rest().get(..bytes);
        let taken = taken.ok_or_else(|| format!("the file ends after {} of its {bytes} bytes", self.rest().len()))?;
        self.at += bytes;
        Ok(taken)
    }

    /// What was asked of the memory, with a lack of it as any other fault.
    pub(super) fn had<T>(&mut self, answer: crate::Result<T>) -> Result<T, String> {
        answer.map_err(|error| {
            let what = error.to_string();
            self.lacking = Some(error);
            what
        })
    }

    /// The next numbers. Those of binary files have their highest byte first.
    pub(super) fn numbers<T: Number>(&mut self, count: usize) -> Result<Vec<T>, String> {
        if self.binary {
            let bytes = self.take(count.saturating_mul(size_of::<T>()))?;
            let mut numbers: Vec<T> = self.had(memory::zeroed("an array", count))?;
            let own = bytemuck::cast_slice_mut(&mut numbers);
            own.copy_from_slice(bytes);
            if cfg!(target_endian = "little") {
                reverse(own, size_of::<T>());
            }
            return Ok(numbers);
        }
        // Each takes two bytes at least: what the file says is not taken for it.
        let mut numbers = Vec::new();
        let most = count.min(self.rest().len() / 2 + 1);
        self.had(memory::reserve("an array", &mut numbers, most))?;
        while numbers.len() < count {
            let token = self.bytes_of_word();
            let token = token.ok_or_else(|| format!("it holds {} numbers, not {count}", numbers.len()))?;
            let number = std::str::from_utf8(token).ok().and_then(T::parse).ok_or_else(|| {
                let found = String::from_utf8_lossy(&token[..token.len().min(40)]);
                if self.is_section(self.at - token.len()) {
                    return format!("it holds {} numbers, not {count}: {found} follows", numbers.len());
                }
                format!("\"{}\" is not a number of its type", found.escape_debug())
            });
            numbers.push(number?);
        }
        Ok(numbers)
    }
}
