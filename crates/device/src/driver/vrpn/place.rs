//! The name of a device on a VRPN server, as the user gives it.

use super::field::Form;
use super::wire::PORT;
use crate::driver::Unavailable;

/// Where a name without a host is looked for.
const HERE: &str = "127.0.0.1";

/// Longest name of a sender, bytes, as VRPN's library has it.
const NAME_MAX: usize = 99;

/// Force that is assumed to be rendered, N: the peak force of a 3D Systems Touch, the weakest of the devices that
/// VRPN serves.
const FORCE: f64 = 3.3;

/// Stiffness that is assumed to be rendered, N/m: what chai3d allows a Touch.
const STIFFNESS: f64 = 400.0;

/// How the link is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// To the server's TCP port; all goes over that one connection.
    Tcp,
    /// The server is asked by datagram to call back; poses and forces then go in datagrams.
    Udp,
}

/// Where the velocity of the handle comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VelocityFrom {
    /// From the poses, here.
    Poses,
    /// From the server.
    Server,
}

/// A device on a server.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    /// Name of the device; none is the first that sends poses.
    pub(super) sender: Option<String>,
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) way: Way,
    /// Number of the sensor.
    pub(super) sensor: i32,
    /// Largest force, N.
    pub(super) force: f64,
    /// Largest stiffness, N/m.
    pub(super) stiffness: f64,
    /// Were both given?
    pub(super) is_rated: bool,
    pub(super) form: Form,
    pub(super) velocity: VelocityFrom,
}

impl Place {
    /// From `[tcp://|udp://]NAME@HOST[:PORT][?force=N&stiffness=N/m&sensor=N&field=near&velocity=server]`.
    pub(super) fn parse(given: &str) -> Result<Self, Unavailable> {
        Self::try_parse(given).map_err(|wrong| Unavailable::UnknownName {
            given: format!("vrpn:{given}"),
            mend: format!(
                "{wrong}; a device on a VRPN server is vrpn:NAME@HOST[:PORT], where the server may call back and \
                 send datagrams vrpn:udp://NAME@HOST[:PORT], behind it for instance ?force=3.3&stiffness=400"
            ),
        })
    }

    fn try_parse(given: &str) -> Result<Self, String> {
        let (address, options) = given.split_once('?').unwrap_or((given, ""));
        let (mut way, address) = split_way(address);
        let (sender, host) = match address.split_once('@') {
            Some((sender, host)) => {
                let (later, host) = split_way(host);
                way = way.or(later);
                (sender, host)
            }
            None => (address, HERE),
        };
        let (host, port) = split_port(host)?;
        let mut place = Self {
            sender: (!address.is_empty()).then(|| sender.to_owned()),
            host: host.to_owned(),
            port,
            way: way.unwrap_or(Way::Tcp),
            sensor: 0,
            force: FORCE,
            stiffness: STIFFNESS,
            is_rated: false,
            form: Form::default(),
            velocity: VelocityFrom::Poses,
        };
        place.check_sender()?;
        let is_given = |key| options.split('&').any(|option| option.starts_with(key));
        place.is_rated = is_given("force=") && is_given("stiffness=");
        for option in options.split('&').filter(|option| !option.is_empty()) {
            place.set(option)?;
        }
        Ok(place)
    }

    fn check_sender(&self) -> Result<(), String> {
        let Some(name) = &self.sender else {
            return Ok(());
        };
        if name.is_empty() {
            return Err("the name of the device is missing".to_owned());
        }
        if name.len() > NAME_MAX || name.contains(char::is_control) {
            return Err(format!(
                "the name of the device must have at most {NAME_MAX} bytes and no control characters"
            ));
        }
        Ok(())
    }

    fn set(&mut self, option: &str) -> Result<(), String> {
        let (key, value) = option.split_once('=').unwrap_or((option, ""));
        match (key, value) {
            ("force", _) => {
                self.force = number(key, value, 0.1, 50.0)?;
            }
            ("stiffness", _) => self.stiffness = number(key, value, 10.0, 1e4)?,
            ("sensor", _) => self.sensor = number(key, value, 0.0, 255.0)? as i32,
            ("field", "near") => self.form = Form::Near,
            ("field", "wide") => self.form = Form::Wide,
            ("velocity", "server") => self.velocity = VelocityFrom::Server,
            ("velocity", "poses") => self.velocity = VelocityFrom::Poses,
            _ => {
                return Err(format!(
                    "\"{option}\" is none of force=N, stiffness=N/m, sensor=NUMBER, field=near|wide, \
                     velocity=server|poses"
                ));
            }
        }
        Ok(())
    }

    /// Host and port for people.
    pub(super) fn server(&self) -> String {
        if self.host.contains(':') {
            format!("[{}]:{}", self.host, self.port)
        } else {
            format!("{}:{}", self.host, self.port)
        }
    }
}

/// The way that an address begins with, if it does, and the rest.
fn split_way(address: &str) -> (Option<Way>, &str) {
    for (prefix, way) in [
        ("tcp://", Way::Tcp),
        ("udp://", Way::Udp),
        // VRPN's own word for the usual way.
        ("x-vrpn://", Way::Udp),
    ] {
        if let Some(rest) = address.strip_prefix(prefix) {
            return (Some(way), rest);
        }
    }
    (None, address)
}

fn split_port(address: &str) -> Result<(&str, u16), String> {
    let (host, port) = if let Some(v6) = address.strip_prefix('[') {
        let (host, rest) = v6
            .split_once(']')
            .ok_or_else(|| format!("the address \"{address}\" has no closing bracket"))?;
        (host, rest.strip_prefix(':'))
    } else {
        match address.split_once(':') {
            Some((host, port)) => (host, Some(port)),
            None => (address, None),
        }
    };
    let is_of_host = |c: char| c.is_ascii_alphanumeric() || ".-_:%".contains(c);
    if host.is_empty() || !host.chars().all(is_of_host) {
        return Err(format!("\"{host}\" is no host"));
    }
    let port = match port {
        None => PORT,
        Some(port) => match port.parse() {
            Ok(port) if port > 0 => port,
            _ => return Err(format!("\"{port}\" is no port")),
        },
    };
    Ok((host, port))
}

fn number(key: &str, value: &str, least: f64, most: f64) -> Result<f64, String> {
    match value.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!(
            "{key} is \"{value}\"; it must be from {least} to {most}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_their_place() {
        for (given, sender, server, way) in [
            ("Phantom0@host", "Phantom0", "host:3883", Way::Tcp),
            (
                "Phantom0@10.0.0.7:4000",
                "Phantom0",
                "10.0.0.7:4000",
                Way::Tcp,
            ),
            ("tcp://Phantom0@host", "Phantom0", "host:3883", Way::Tcp),
            ("Phantom0@tcp://host:1", "Phantom0", "host:1", Way::Tcp),
            ("udp://Phantom0@host", "Phantom0", "host:3883", Way::Udp),
            ("Phantom0@x-vrpn://host", "Phantom0", "host:3883", Way::Udp),
            ("A b@[fe80::1%eth0]:5", "A b", "[fe80::1%eth0]:5", Way::Tcp),
            ("Hand0", "Hand0", "127.0.0.1:3883", Way::Tcp),
        ] {
            let place = Place::parse(given).unwrap();
            assert_eq!(place.sender.as_deref(), Some(sender), "{given}");
            assert_eq!(place.server(), server, "{given}");
            assert_eq!(place.way, way, "{given}");
        }
        for first in ["", "udp://", "?force=2"] {
            assert_eq!(Place::parse(first).unwrap().sender, None);
        }
    }

    #[test]
    fn options_are_taken_and_bounded() {
        let given = "P@h?force=10&stiffness=1000&sensor=2&field=near&velocity=server";
        let place = Place::parse(given).unwrap();
        assert_eq!((place.force, place.stiffness), (10.0, 1000.0));
        assert_eq!((place.sensor, place.form), (2, Form::Near));
        assert_eq!(place.velocity, VelocityFrom::Server);
        assert!(place.is_rated);
        let plain = Place::parse("P@h?").unwrap();
        assert_eq!((plain.force, plain.stiffness), (FORCE, STIFFNESS));
        assert!(!plain.is_rated);
        for option in [
            "force=1e9",
            "force=NaN",
            "force=-1",
            "force=",
            "force",
            "stiffness=inf",
            "sensor=-1",
            "field=far",
            "velocity=x",
            "speed=1",
        ] {
            let error = Place::parse(&format!("P@h?{option}")).unwrap_err();
            let key = option.split('=').next().unwrap();
            assert!(error.to_string().contains(key), "{error}");
        }
    }

    #[test]
    fn names_that_lead_nowhere_are_refused_with_the_form() {
        let long = format!("{}@h", "x".repeat(100));
        for given in [
            "@host",
            "P@",
            "P@host:",
            "P@host:0",
            "P@host:99999",
            "P@ho st",
            "P@[::1",
            "P@a/b",
            "\u{7}@host",
            &long,
            "P@host:1:2",
        ] {
            let error = Place::parse(given).unwrap_err();
            assert!(error.to_string().contains("vrpn:NAME@HOST"), "{error}");
        }
    }
}
