//! Calls back to clients that ask for it by datagram.

use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Calls under way at the same time; more requests are left out, and come again after 2 s.
const CALLS_MAX: usize = 4;

/// Longest wait for a client to answer.
const CALL: Duration = Duration::from_secs(1);

/// Requests that are read in one period.
const REQUESTS_MAX: usize = 4;

/// Least port of a client.
const PORT_MIN: u16 = 1024;

/// The calls, each on a thread of its own: a call may block, the loop may not.
#[derive(Debug)]
pub(super) struct Callers {
    under_way: Vec<SocketAddr>,
    tell: Sender<(SocketAddr, Option<TcpStream>)>,
    told: Receiver<(SocketAddr, Option<TcpStream>)>,
}

impl Callers {
    pub(super) fn new() -> Self {
        let (tell, told) = channel();
        Self {
            under_way: Vec::new(),
            tell,
            told,
        }
    }

    /// Reads the requests that came and calls who asked.
    pub(super) fn read(&mut self, requests: &UdpSocket) {
        let mut buffer = [0; 256];
        for _ in 0..REQUESTS_MAX {
            let Ok((count, from)) = requests.recv_from(&mut buffer) else {
                return;
            };
            if let Some(port) = port_asked_for(&buffer[..count]) {
                self.call(SocketAddr::new(from.ip(), port));
            }
        }
    }

    fn call(&mut self, client: SocketAddr) {
        if self.under_way.len() >= CALLS_MAX || self.under_way.contains(&client) {
            return;
        }
        let tell = self.tell.clone();
        let thread = std::thread::Builder::new().name("vrpn call".to_owned());
        let spawned = thread.spawn(move || {
            let answered = TcpStream::connect_timeout(&client, CALL).ok();
            let _server_has_gone = tell.send((client, answered));
        });
        if spawned.is_ok() {
            self.under_way.push(client);
        }
    }

    /// The next client that answered.
    pub(super) fn answered(&mut self) -> Option<TcpStream> {
        while let Ok((client, answered)) = self.told.try_recv() {
            self.under_way.retain(|address| *address != client);
            if answered.is_some() {
                return answered;
            }
        }
        None
    }
}

/// The port out of a request `HOST PORT`. The host is not read: the call goes to where the request came from, so that
/// nobody can have a third one called.
fn port_asked_for(request: &[u8]) -> Option<u16> {
    let text = request.split(|byte| *byte == 0).next()?;
    let mut words = std::str::from_utf8(text).ok()?.split_ascii_whitespace();
    let (_host, port) = (words.next()?, words.next()?);
    let port = port.parse().ok()?;
    (words.next().is_none() && port >= PORT_MIN).then_some(port)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_that_are_none_are_not_answered() {
        assert_eq!(port_asked_for(b"127.0.0.1 34623\0"), Some(34623));
        assert_eq!(port_asked_for(b"host 1024"), Some(1024));
        for bad in [
            b"".as_slice(),
            b"\0",
            b"34623\0",
            b"127.0.0.1 80\0",
            b"127.0.0.1 99999\0",
            b"127.0.0.1 -5\0",
            b"127.0.0.1 5000 5001\0",
            b"\xff\xfe 5000\0",
        ] {
            assert_eq!(port_asked_for(bad), None);
        }
    }
}
