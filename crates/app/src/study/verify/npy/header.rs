//! The header of a NumPy array: `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.

/// Axes of an array. A case has lists and matrices; a shape of more is refused where it is used.
const MOST_AXES: usize = 32;
/// Digits of a side: what fits into 64 bits.
const MOST_DIGITS: usize = 19;

/// What a header says.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) descr: String,
    pub(super) is_fortran: bool,
    pub(super) shape: Vec<u64>,
}

/// Where and why a header is not read.
#[derive(Debug)]
pub(super) struct HeaderError {
    /// Byte of the header.
    pub(super) at: usize,
    pub(super) what: String,
}

impl Header {
    /// One pass without recursion: nested brackets are no value of any key, and end it.
    pub(super) fn parse(text: &str) -> Result<Self, HeaderError> {
        let mut cursor = Cursor {
            bytes: text.as_bytes(),
            at: 0,
        };
        let (mut descr, mut is_fortran, mut shape) = (None, None, None);
        cursor.expect(b'{', "a dictionary, `{`,")?;
        while !cursor.takes(b'}') {
            let start = cursor.place();
            let key = cursor.text("the name of a key")?;
            cursor.expect(b':', "`:` after a key")?;
            let is_new = match key {
                "descr" => descr
                    .replace(cursor.text("the type of the entries, such as '<f8',")?)
                    .is_none(),
                "fortran_order" => is_fortran.replace(cursor.flag()?).is_none(),
                "shape" => shape.replace(cursor.tuple()?).is_none(),
                _ => {
                    return Err(HeaderError {
                        at: start,
                        what: format!(
                            "key {key:?} in the header; there are 'descr', 'fortran_order' and 'shape'"
                        ),
                    });
                }
            };
            if !is_new {
                return Err(HeaderError {
                    at: start,
                    what: format!("key {key:?} comes twice in the header"),
                });
            }
            if !cursor.takes(b',') {
                cursor.expect(b'}', "`,` or `}` after a value")?;
                break;
            }
        }
        cursor.end()?;
        let missing = |key: &str| HeaderError {
            at: 0,
            what: format!("the header has no key '{key}'"),
        };
        Ok(Self {
            descr: descr.ok_or_else(|| missing("descr"))?.to_owned(),
            is_fortran: is_fortran.ok_or_else(|| missing("fortran_order"))?,
            shape: shape.ok_or_else(|| missing("shape"))?,
        })
    }
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    /// Next place that is not blank.
    fn place(&mut self) -> usize {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        self.at
    }

    fn takes(&mut self, byte: u8) -> bool {
        let at = self.place();
        let is_there = self.bytes.get(at) == Some(&byte);
        self.at += usize::from(is_there);
        is_there
    }

    fn expect(&mut self, byte: u8, wanted: &str) -> Result<(), HeaderError> {
        if self.takes(byte) {
            Ok(())
        } else {
            Err(self.found_instead_of(wanted))
        }
    }

    fn found_instead_of(&mut self, wanted: &str) -> HeaderError {
        let at = self.place();
        let found = match self.bytes.get(at) {
            Some(byte) => format!("{:?}", char::from(*byte)),
            None => "nothing more".to_owned(),
        };
        HeaderError {
            at,
            what: format!("the header has {found} where {wanted} is wanted"),
        }
    }

    fn text(&mut self, wanted: &str) -> Result<&'a str, HeaderError> {
        let start = self.place();
        let Some(quote @ (b'\'' | b'"')) = self.bytes.get(start).copied() else {
            return Err(self.found_instead_of(wanted));
        };
        let inside = &self.bytes[start + 1..];
        let Some(length) = inside.iter().position(|b| *b == quote) else {
            return Err(HeaderError {
                at: start,
                what: "a text in the header has no end".to_owned(),
            });
        };
        self.at = start + 2 + length;
        Ok(std::str::from_utf8(&inside[..length]).unwrap_or_default())
    }

    fn flag(&mut self) -> Result<bool, HeaderError> {
        let at = self.place();
        for (word, value) in [("True", true), ("False", false)] {
            if self.bytes[at..].starts_with(word.as_bytes()) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(self.found_instead_of("True or False"))
    }

    fn tuple(&mut self) -> Result<Vec<u64>, HeaderError> {
        let start = self.place();
        self.expect(b'(', "a shape, such as (3, 4),")?;
        let mut sides = Vec::new();
        let mut comma = true;
        while !self.takes(b')') {
            if !comma {
                return Err(self.found_instead_of("`,` or `)`"));
            }
            if sides.len() == MOST_AXES {
                return Err(HeaderError {
                    at: start,
                    what: format!("a shape of more than {MOST_AXES} axes"),
                });
            }
            sides.push(self.side()?);
            comma = self.takes(b',');
        }
        // (3) is a number in Python.
        if sides.len() == 1 && !comma {
            return Err(HeaderError {
                at: start,
                what: format!("the shape of a list is written ({},)", sides[0]),
            });
        }
        Ok(sides)
    }

    fn side(&mut self) -> Result<u64, HeaderError> {
        let at = self.place();
        let digits = self.bytes[at..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count();
        if digits == 0 {
            return Err(self.found_instead_of("a number of entries"));
        }
        let text = std::str::from_utf8(&self.bytes[at..at + digits]).unwrap_or_default();
        let side = if digits <= MOST_DIGITS {
            text.parse().ok()
        } else {
            None
        };
        self.at += digits;
        // Python 2 wrote long integers so.
        self.takes(b'L');
        side.ok_or_else(|| HeaderError {
            at,
            what: "a side of the shape that does not fit into 64 bits".to_owned(),
        })
    }

    fn end(&mut self) -> Result<(), HeaderError> {
        if self.place() == self.bytes.len() {
            Ok(())
        } else {
            Err(self.found_instead_of("the end of the header"))
        }
    }
}
