//! Which device of which service: what stands after `haply:`.

use crate::driver::Unavailable;

const HOST: &str = "localhost";
const PORT: u16 = 10001;
const EVENTS_PORT: u16 = 10020;

/// Longest identifier and host name, bytes.
const ID_MAX: usize = 64;
const HOST_MAX: usize = 255;

/// A device of a service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Place {
    /// Identifier of the device; the first one where there is none.
    pub(super) id: Option<String>,
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) events_port: u16,
}

impl Default for Place {
    fn default() -> Self {
        Self {
            id: None,
            host: HOST.to_owned(),
            port: PORT,
            events_port: EVENTS_PORT,
        }
    }
}

impl Place {
    /// Reads `[ID][@host[:port[,events port]]]`; an IPv6 address stands in brackets.
    pub(super) fn parse(text: &str) -> Result<Self, Unavailable> {
        Self::read(text).ok_or_else(|| Unavailable::UnknownName {
            given: format!("{}:{}", super::KEY, super::messages::plain(text)),
            mend: "a Haply device is named haply, haply:049D or haply:049D@host:10001, with its identifier as \
                   `snapin devices` lists it; where the service's events have another port, haply:049D@host:10001,10020"
                .to_owned(),
        })
    }

    fn read(text: &str) -> Option<Self> {
        let mut place = Self::default();
        let (id, at) = match text.split_once('@') {
            Some((id, at)) => (id, Some(at)),
            None => (text, None),
        };
        if !id.is_empty() {
            let is_fit = id.len() <= ID_MAX
                && id
                    .bytes()
                    .all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
            place.id = is_fit.then(|| Some(id.to_owned()))?;
        }
        let Some(at) = at else {
            return Some(place);
        };
        let host_end = match at.strip_prefix('[') {
            Some(_) => at.find(']')? + 1,
            None => at.find(':').unwrap_or(at.len()),
        };
        let (host, ports) = at.split_at(host_end);
        let is_fit = !host.is_empty()
            && host.len() <= HOST_MAX
            && host
                .bytes()
                .all(|b| b.is_ascii_alphanumeric() || b"-._[]:".contains(&b));
        place.host = is_fit.then(|| host.to_owned())?;
        if ports.is_empty() {
            return Some(place);
        }
        let (port, events) = match ports.strip_prefix(':')?.split_once(',') {
            Some((port, events)) => (port, Some(events)),
            None => (ports.strip_prefix(':')?, None),
        };
        place.port = read_port(port)?;
        if let Some(events) = events {
            place.events_port = read_port(events)?;
        }
        Some(place)
    }

    /// Name to open a device of this service by.
    pub(super) fn name_of(&self, id: &str) -> String {
        let here = Self::default();
        let key = super::KEY;
        if (&self.host, self.port, self.events_port) == (&here.host, here.port, here.events_port) {
            return format!("{key}:{id}");
        }
        let Self { host, port, .. } = self;
        if self.events_port == here.events_port {
            return format!("{key}:{id}@{host}:{port}");
        }
        format!("{key}:{id}@{host}:{port},{}", self.events_port)
    }

    /// The simulation channel.
    pub(super) fn url(&self) -> String {
        format!("ws://{}:{}", self.host, self.port)
    }

    /// The events channel.
    pub(super) fn events_url(&self) -> String {
        format!("ws://{}:{}", self.host, self.events_port)
    }
}

fn read_port(text: &str) -> Option<u16> {
    text.parse().ok().filter(|port| *port > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(id: &str, host: &str, port: u16, events_port: u16) -> Place {
        Place {
            id: (!id.is_empty()).then(|| id.to_owned()),
            host: host.to_owned(),
            port,
            events_port,
        }
    }

    #[test]
    fn places_are_read_and_named_back() {
        for (text, expected) in [
            ("", place("", "localhost", 10001, 10020)),
            ("049D", place("049D", "localhost", 10001, 10020)),
            ("@lab-pc", place("", "lab-pc", 10001, 10020)),
            ("049D@lab:8500", place("049D", "lab", 8500, 10020)),
            ("049D@lab:8500,9000", place("049D", "lab", 8500, 9000)),
            ("A1@[::1]:7", place("A1", "[::1]", 7, 10020)),
            ("A1@[::1]", place("A1", "[::1]", 10001, 10020)),
        ] {
            assert_eq!(Place::parse(text).unwrap(), expected, "{text}");
            if let Some(id) = &expected.id {
                let name = expected.name_of(id);
                let again = Place::parse(name.strip_prefix("haply:").unwrap());
                assert_eq!(again.unwrap(), expected, "{name}");
            }
        }
    }

    #[test]
    fn what_is_no_place_is_refused_with_the_mend() {
        let long = "x".repeat(1000);
        for text in [
            "04 9D",
            "049D@",
            "@:10001",
            "049D@lab:",
            "049D@lab:0",
            "049D@lab:70000",
            "049D@lab:1,",
            "049D@lab:1,x",
            "049D@la/b",
            "049D@[::1",
            "é",
            "049D@lab\n",
            "a@b@c",
            &long,
        ] {
            let error = Place::parse(text).unwrap_err().to_string();
            assert!(error.contains("haply:049D@host:10001"), "{text}: {error}");
        }
    }
}
