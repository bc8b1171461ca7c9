//! One end of a link, the client's or the server's: sockets, bytes that wait, and what the other side described.

use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use thiserror::Error;

use super::message::{Kind, Message};
use super::peer::{Event, Ours, Peer};
use super::wire::{COOKIE, DATAGRAM_MAX, Decoder, ProtocolError, Timestamp, read_datagram};

/// Bytes that are read at once.
const READ_LEN: usize = 1 << 14;

/// Pieces that are read in one go, so that a flood does not hold the loop.
const READS_MAX: usize = 16;

/// Bytes that may wait to be sent; beyond that the other side has stopped reading.
const WAITING_MAX: usize = 1 << 18;

/// Time for which bytes may wait without any being taken, s.
const STUCK_S: f64 = 1.0;

/// Why a link cannot go on.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(super) enum Broken {
    #[error("the other side closed the connection")]
    Closed,
    #[error("the other side has stopped reading")]
    Stuck,
    #[error("{0}")]
    Io(String),
    #[error("what the other side sends is not understood: {0}")]
    Protocol(#[from] ProtocolError),
}

impl From<std::io::Error> for Broken {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error.to_string())
    }
}

/// How a message is to travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Service {
    /// On the connection, in order.
    Reliable,
    /// In a datagram where there are any; left out where bytes already wait: a newer one will follow.
    Newest,
}

/// Datagrams beside the connection.
#[derive(Debug)]
struct Datagrams {
    socket: UdpSocket,
    /// Where the other side takes them, once it said so.
    to: Option<SocketAddr>,
    /// Messages that go with the next one.
    pending: Vec<u8>,
    /// Has any come?
    is_heard: bool,
}

/// One end of a link. Nothing here blocks, but for the wait of [`receive`](Self::receive).
#[derive(Debug)]
pub(super) struct Endpoint {
    tcp: TcpStream,
    peer_ip: IpAddr,
    datagrams: Option<Datagrams>,
    decoder: Decoder,
    peer: Peer,
    ours: Ours,
    waiting: Vec<u8>,
    stuck_since: Option<Instant>,
    scratch: Vec<u8>,
    buffer: Box<[u8]>,
    heard_at: Instant,
}

impl Endpoint {
    /// An end of this connection. Greets, and says where datagrams are taken if there are to be any.
    pub(super) fn new(tcp: TcpStream, with_datagrams: bool) -> Result<Self, Broken> {
        tcp.set_nodelay(true)?;
        tcp.set_nonblocking(true)?;
        let peer_ip = tcp.peer_addr()?.ip();
        let mut ours = Ours::default();
        let mut waiting = COOKIE.to_vec();
        let datagrams = match with_datagrams {
            false => None,
            true => {
                let socket = UdpSocket::bind((tcp.local_addr()?.ip(), 0))?;
                socket.set_nonblocking(true)?;
                let own = socket.local_addr()?;
                ours.describe_udp(own.port(), &own.ip().to_string(), &mut waiting);
                Some(Datagrams {
                    socket,
                    to: None,
                    pending: Vec::new(),
                    is_heard: false,
                })
            }
        };
        let mut endpoint = Self {
            tcp,
            peer_ip,
            datagrams,
            decoder: Decoder::new(),
            peer: Peer::default(),
            ours,
            waiting,
            stuck_since: None,
            scratch: Vec::new(),
            buffer: vec![0; READ_LEN].into_boxed_slice(),
            heard_at: Instant::now(),
        };
        endpoint.flush()?;
        Ok(endpoint)
    }

    /// Version of the other side, once it has greeted.
    pub(super) fn version(&self) -> Option<&str> {
        self.decoder.version()
    }

    /// When anything came last.
    pub(super) fn heard_at(&self) -> Instant {
        self.heard_at
    }

    /// Do bytes wait because the other side does not take them?
    pub(super) fn is_congested(&self) -> bool {
        self.stuck_since.is_some()
    }

    /// Describes the sender of a device, and the types that are sent and taken.
    pub(super) fn describe(&mut self, device: &str, kinds: &[Kind]) {
        self.ours.describe(device, kinds, &mut self.waiting);
    }

    /// Sends a message with the next [`flush`](Self::flush).
    pub(super) fn send(&mut self, service: Service, message: &Message) {
        let now = Timestamp::now();
        let is_newest = service == Service::Newest;
        if let Some(datagrams) = &mut self.datagrams
            && let (true, Some(_)) = (is_newest, datagrams.to)
        {
            self.scratch.clear();
            self.ours.pack(message, now, &mut self.scratch);
            if datagrams.pending.len() + self.scratch.len() > DATAGRAM_MAX {
                datagrams.send();
            }
            datagrams.pending.extend_from_slice(&self.scratch);
        } else if !(is_newest && self.is_congested()) {
            self.ours.pack(message, now, &mut self.waiting);
        }
    }

    /// Hands to the system what it takes.
    pub(super) fn flush(&mut self) -> Result<(), Broken> {
        if let Some(datagrams) = &mut self.datagrams {
            datagrams.send();
        }
        while !self.waiting.is_empty() {
            match self.tcp.write(&self.waiting) {
                Ok(0) => return Err(Broken::Closed),
                Ok(taken) => {
                    self.waiting.drain(..taken);
                    self.stuck_since = None;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => {
                    let since = *self.stuck_since.get_or_insert_with(Instant::now);
                    let is_stuck = since.elapsed().as_secs_f64() > STUCK_S;
                    if is_stuck || self.waiting.len() > WAITING_MAX {
                        return Err(Broken::Stuck);
                    }
                    break;
                }
                Err(e) => return Err(e.into()),
            }
        }
        Ok(())
    }

    /// Hands over what has come; where nothing has, waits for it.
    ///
    /// What came before a failure is handed over first. Of datagrams only those of the other side's address count,
    /// and one that is not understood is left out: anybody could have sent it.
    pub(super) fn receive(
        &mut self,
        wait: Duration,
        mut on_event: impl FnMut(Event<'_>),
    ) -> Result<(), Broken> {
        let mut has_come = self.receive_datagrams(&mut on_event);
        has_come |= self.receive_stream(READS_MAX, &mut on_event)?;
        if !has_come && !wait.is_zero() {
            match &self.datagrams {
                // Poses come in datagrams, so the next thing to come is one.
                Some(datagrams) if datagrams.is_heard => {
                    datagrams.wait(wait);
                    has_come = self.receive_datagrams(&mut on_event);
                    has_come |= self.receive_stream(READS_MAX, &mut on_event)?;
                }
                _ => {
                    self.tcp.set_read_timeout(Some(wait))?;
                    self.tcp.set_nonblocking(false)?;
                    let result = self.receive_stream(1, &mut on_event);
                    self.tcp.set_nonblocking(true)?;
                    has_come = result?;
                }
            }
        }
        if has_come {
            self.heard_at = Instant::now();
        }
        Ok(())
    }

    fn receive_stream(
        &mut self,
        reads: usize,
        on_event: &mut impl FnMut(Event<'_>),
    ) -> Result<bool, Broken> {
        let mut has_come = false;
        for _ in 0..reads {
            match self.tcp.read(&mut self.buffer) {
                Ok(0) => return Err(Broken::Closed),
                Ok(count) => {
                    has_come = true;
                    self.understand(count, on_event)?;
                    if count < self.buffer.len() {
                        break;
                    }
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
                Err(e) => return Err(e.into()),
            }
        }
        Ok(has_come)
    }

    fn understand(
        &mut self,
        count: usize,
        on_event: &mut impl FnMut(Event<'_>),
    ) -> Result<(), ProtocolError> {
        let Self {
            decoder,
            peer,
            datagrams,
            peer_ip,
            ..
        } = self;
        decoder.push(&self.buffer[..count], |frame| {
            let event = peer.read(&frame)?;
            if let (Event::Udp { port, .. }, Some(datagrams)) = (&event, datagrams.as_mut()) {
                // To the address of the connection, whatever the other side calls itself: no one else is written to.
                datagrams.to = Some(SocketAddr::new(*peer_ip, *port));
            }
            on_event(event);
            Ok(())
        })
    }

    fn receive_datagrams(&mut self, on_event: &mut impl FnMut(Event<'_>)) -> bool {
        let Some(datagrams) = &mut self.datagrams else {
            return false;
        };
        let mut has_come = false;
        for _ in 0..READS_MAX {
            // A failure here is an earlier datagram's that nobody took; the connection decides about the link.
            let Ok((count, from)) = datagrams.socket.recv_from(&mut self.buffer) else {
                break;
            };
            if from.ip() == self.peer_ip {
                has_come = true;
                let peer = &self.peer;
                let _left_out = read_datagram(&self.buffer[..count], |frame| {
                    on_event(peer.message(&frame)?);
                    Ok(())
                });
            }
        }
        datagrams.is_heard |= has_come;
        has_come
    }

    /// Says that nothing more will be sent, and waits a little until the other side has read it all: a socket that is
    /// closed over unread bytes takes back what it sent last.
    pub(super) fn leave(&mut self, wait: Duration) {
        let begun = Instant::now();
        while self.flush().is_ok() && !self.waiting.is_empty() && begun.elapsed() < wait {
            std::thread::sleep(Duration::from_millis(1));
        }
        if self.tcp.shutdown(Shutdown::Write).is_err() {
            return;
        }
        while begun.elapsed() < wait {
            if self.receive(Duration::from_millis(5), |_| {}).is_err() {
                return;
            }
        }
    }
}

impl Datagrams {
    /// Sends what is pending. What nobody takes is lost, as any datagram may be.
    fn send(&mut self) {
        if let (Some(to), false) = (self.to, self.pending.is_empty()) {
            let _lost = self.socket.send_to(&self.pending, to);
        }
        self.pending.clear();
    }

    /// Waits until one has come.
    fn wait(&self, wait: Duration) {
        let socket = &self.socket;
        let looked = socket
            .set_read_timeout(Some(wait))
            .and_then(|()| socket.set_nonblocking(false))
            .and_then(|()| socket.peek_from(&mut [0; 1]));
        let _next_read_tells = (looked, socket.set_nonblocking(true));
    }
}

#[cfg(test)]
pub(super) mod tests;
