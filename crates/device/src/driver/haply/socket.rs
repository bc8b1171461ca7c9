//! A WebSocket with an end to every wait and to every size.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, HandshakeError, Message, WebSocket, client::client_with_config};

/// Longest message that is taken, bytes: a full inventory of a device and a grip has 2 kB.
pub(super) const MESSAGE_MAX: usize = 256 * 1024;

/// Most bytes that may wait to be sent: a frame of ours has 300.
const SEND_MAX: usize = 64 * 1024;

/// Longest time to hand a frame to the operating system, s. One frame is in flight, so its buffers are empty.
const SEND_S: f64 = 0.02;

/// Addresses of one host that are tried.
const ADDRESSES_MAX: usize = 4;

/// Pings and the like that are passed over before one read is given up.
const CONTROL_MAX: usize = 64;

/// Messages that are thrown away at once.
const DRAIN_MAX: usize = 32;

/// Why no socket could be opened.
#[derive(Debug)]
pub(super) enum NotOpened {
    /// Nobody answers there.
    Nobody(String),
    /// Somebody answers, but not as a WebSocket.
    NoWebSocket(String),
}

/// An open WebSocket.
#[derive(Debug)]
pub(super) struct Socket {
    web: WebSocket<Timed>,
}

impl Socket {
    /// Opens `ws://host:port/` and waits `limit` for each of the host's addresses and for the greeting.
    pub(super) fn open(host: &str, port: u16, limit: Duration) -> Result<Self, NotOpened> {
        let stream = connect(host, port, limit).map_err(|e| NotOpened::Nobody(e.to_string()))?;
        let timed = Timed {
            stream,
            until: Some(Instant::now() + limit),
        };
        let config = WebSocketConfig::default()
            .read_buffer_size(16 * 1024)
            .write_buffer_size(0)
            .max_write_buffer_size(SEND_MAX)
            .max_message_size(Some(MESSAGE_MAX))
            .max_frame_size(Some(MESSAGE_MAX));
        match client_with_config(format!("ws://{host}:{port}/"), timed, Some(config)) {
            Ok((web, _)) => Ok(Self { web }),
            Err(HandshakeError::Interrupted(_)) => {
                Err(NotOpened::NoWebSocket("it does not greet back".to_owned()))
            }
            Err(HandshakeError::Failure(e)) => Err(NotOpened::NoWebSocket(e.to_string())),
        }
    }

    /// Sends a text.
    ///
    /// # Errors
    /// Why the connection is of no use any more.
    pub(super) fn send(&mut self, text: String) -> Result<(), String> {
        self.web.send(Message::text(text)).map_err(|e| match e {
            Error::Io(e) if e.kind() == io::ErrorKind::WouldBlock => {
                "it does not take what is sent".to_owned()
            }
            e => e.to_string(),
        })
    }

    /// The next text, waiting no longer than until `until`. A binary message, which the service never sends, is
    /// an empty text.
    ///
    /// # Errors
    /// Why the connection is of no use any more.
    pub(super) fn read_until(&mut self, until: Instant) -> Result<Option<String>, String> {
        self.web.get_mut().until = Some(until);
        self.read()
    }

    /// The next text that has already arrived.
    ///
    /// # Errors
    /// As above.
    pub(super) fn read_now(&mut self) -> Result<Option<String>, String> {
        let timed = self.web.get_mut();
        timed.until = None;
        timed
            .stream
            .set_nonblocking(true)
            .map_err(|e| e.to_string())?;
        let text = self.read();
        let back = self.web.get_ref().stream.set_nonblocking(false);
        back.map_err(|e| e.to_string())?;
        text
    }

    /// Throws away what has already arrived, and says how many messages that were.
    ///
    /// # Errors
    /// As above.
    pub(super) fn drain(&mut self) -> Result<usize, String> {
        for n in 0..DRAIN_MAX {
            if self.read_now()?.is_none() {
                return Ok(n);
            }
        }
        Ok(DRAIN_MAX)
    }

    /// Says goodbye, if anybody still listens.
    pub(super) fn close(&mut self) {
        let _nobody_listens = self.web.close(None);
        let _nobody_listens = self.web.flush();
    }

    fn read(&mut self) -> Result<Option<String>, String> {
        for _ in 0..CONTROL_MAX {
            match self.web.read() {
                Ok(Message::Text(text)) => return Ok(Some(text.as_str().to_owned())),
                Ok(Message::Binary(_)) => return Ok(Some(String::new())),
                Ok(Message::Close(_)) => return Err("it closed the connection".to_owned()),
                Ok(_) => {}
                Err(Error::Io(e)) if e.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(e) => return Err(e.to_string()),
            }
        }
        Ok(None)
    }
}

/// Connects to the first address of the host that answers.
fn connect(host: &str, port: u16, limit: Duration) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    for address in (bare, port).to_socket_addrs()?.take(ADDRESSES_MAX) {
        match TcpStream::connect_timeout(&address, limit) {
            Ok(stream) => {
                // A frame is small and waited for: it must not be held back to be sent with others.
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(Duration::from_secs_f64(SEND_S)))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// A stream whose reads end at a time, however slowly the bytes come.
#[derive(Debug)]
struct Timed {
    stream: TcpStream,
    /// `None`: reads do not wait at all.
    until: Option<Instant>,
}

impl Read for Timed {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if let Some(until) = self.until {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            self.stream.set_read_timeout(Some(left))?;
        }
        self.stream.read(bytes).map_err(as_would_block)
    }
}

impl Write for Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes).map_err(as_would_block)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// A wait that ended has two names, by operating system.
fn as_would_block(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::TimedOut => io::ErrorKind::WouldBlock.into(),
        _ => error,
    }
}
