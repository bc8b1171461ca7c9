//! Words, numbers and sections of an MSH file, text or binary, with the place for messages.

use crate::Error;

pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_binary: bool,
    swap: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            // Behind a byte order mark.
            at: if bytes.starts_with(b"\xef\xbb\xbf") {
                3
            } else {
                0
            },
            is_binary: false,
            swap: false,
        }
    }

    /// An error at the present place.
    pub(super) fn wrong(&self, what: &str) -> Error {
        let place = if self.is_binary {
            format!("byte {}", self.at)
        } else {
            let before = &self.bytes[..self.at.min(self.bytes.len())];
            format!(
                "line {}",
                1 + before.iter().filter(|b| **b == b'\n').count()
            )
        };
        Error::Format {
            place,
            what: what.to_owned(),
        }
    }

    /// An error in the line that [`Self::text_line`] has just passed.
    pub(super) fn wrong_line(&self, what: &str) -> Error {
        let before = self.at.saturating_sub(1);
        Self {
            at: before,
            ..*self
        }
        .wrong(what)
    }

    fn cut_short(&self) -> Error {
        self.wrong("the file ends too early; it was not written or copied completely")
    }

    /// Name of the next section, or `None` at the end of the file.
    pub(super) fn section(&mut self) -> Result<Option<String>, Error> {
        self.skip_space();
        if self.at >= self.bytes.len() {
            return Ok(None);
        }
        let line = self.text_line()?;
        match line.trim().strip_prefix('$') {
            Some(name) if !name.is_empty() && name.len() < 100 => Ok(Some(name.to_owned())),
            _ => {
                Err(self.wrong_line("is no Gmsh mesh here: a section such as $Nodes was expected"))
            }
        }
    }

    /// The line that ends a section.
    pub(super) fn end_of(&mut self, section: &str) -> Result<(), Error> {
        self.skip_space();
        if self.at >= self.bytes.len() {
            return Err(self.cut_short());
        }
        let line = self.text_line()?;
        if line.trim() == format!("$End{section}") {
            return Ok(());
        }
        Err(self.wrong_line(&format!("$End{section} was expected")))
    }

    /// Passes over a section that is not used.
    pub(super) fn skip_section(&mut self, section: &str) -> Result<(), Error> {
        let end = format!("$End{section}");
        let rest = &self.bytes[self.at..];
        match rest.windows(end.len()).position(|w| w == end.as_bytes()) {
            Some(position) => {
                self.at += position + end.len();
                Ok(())
            }
            None => {
                self.at = self.bytes.len();
                Err(self.cut_short())
            }
        }
    }

    /// The rest of the line.
    pub(super) fn text_line(&mut self) -> Result<String, Error> {
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        if rest.is_empty() {
            return Err(self.cut_short());
        }
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at += (end + 1).min(rest.len());
        Ok(String::from_utf8_lossy(&rest[..end]).into_owned())
    }

    /// A word of text.
    pub(super) fn word(&mut self) -> Result<String, Error> {
        Ok(self.word_str()?.to_owned())
    }

    fn word_str(&mut self) -> Result<&'a str, Error> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        if end == 0 {
            return Err(self.cut_short());
        }
        let word = std::str::from_utf8(&rest[..end])
            .map_err(|_| self.wrong("holds bytes that are no text"))?;
        self.at += end;
        Ok(word)
    }

    fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// From here on numbers are binary; a one tells the byte order.
    pub(super) fn begin_binary(&mut self) -> Result<(), Error> {
        self.text_line()?;
        self.is_binary = true;
        let one: [u8; 4] = self.take()?;
        self.swap = match (i32::from_le_bytes(one), i32::from_be_bytes(one)) {
            (1, _) => false,
            (_, 1) => true,
            _ => return Err(self.wrong("the byte order of the file is not known")),
        };
        Ok(())
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let end = self.at + N;
        let Some(slice) = self.bytes.get(self.at..end) else {
            self.at = self.bytes.len();
            return Err(self.cut_short());
        };
        let mut array = [0; N];
        array.copy_from_slice(slice);
        if self.swap {
            array.reverse();
        }
        self.at = end;
        Ok(array)
    }

    /// A 32-bit integer.
    pub(super) fn int(&mut self) -> Result<i32, Error> {
        if self.is_binary {
            return Ok(i32::from_le_bytes(self.take()?));
        }
        let word = self.word_str()?;
        word.parse()
            .map_err(|_| self.wrong(&format!("{word:?} is no whole number")))
    }

    /// A size or tag.
    pub(super) fn size(&mut self) -> Result<u64, Error> {
        if self.is_binary {
            return Ok(u64::from_le_bytes(self.take()?));
        }
        let word = self.word_str()?;
        word.parse()
            .map_err(|_| self.wrong(&format!("{word:?} is no count or tag")))
    }

    /// A number of things that take at least `bytes_each` (2 in text) each: refused if the file
    /// cannot hold them, so that a damaged count does not ask for all memory.
    pub(super) fn count(&mut self, bytes_each: u64) -> Result<usize, Error> {
        let count = self.size()?;
        self.fitting(count, bytes_each)
    }

    fn fitting(&self, count: u64, bytes_each: u64) -> Result<usize, Error> {
        let each = if self.is_binary { bytes_each } else { 2 };
        let left = (self.bytes.len() - self.at) as u64;
        if count
            .checked_mul(each)
            .is_none_or(|needed| needed > left + 2)
        {
            return Err(self.wrong(&format!(
                "announces {count} entries, more than the rest of the file can hold; it is cut short or damaged"
            )));
        }
        Ok(count as usize)
    }

    /// A tag of 32 bits, as older versions have them.
    pub(super) fn tag(&mut self) -> Result<u64, Error> {
        if !self.is_binary {
            return self.size();
        }
        let tag = self.int()?;
        u64::try_from(tag).map_err(|_| self.wrong(&format!("{tag} is no tag")))
    }

    /// As [`Self::count`] for a number that is a line of text in binary files too.
    pub(super) fn text_count(&mut self, bytes_each: u64) -> Result<usize, Error> {
        let is_binary = std::mem::replace(&mut self.is_binary, false);
        let count = self.size();
        self.is_binary = is_binary;
        if is_binary {
            self.text_line()?;
        }
        self.fitting(count?, bytes_each)
    }

    pub(super) fn is_binary(&self) -> bool {
        self.is_binary
    }

    /// A floating-point number.
    pub(super) fn float(&mut self) -> Result<f64, Error> {
        if self.is_binary {
            return Ok(f64::from_le_bytes(self.take()?));
        }
        let word = self.word_str()?;
        word.parse()
            .map_err(|_| self.wrong(&format!("{word:?} is no number")))
    }
}
