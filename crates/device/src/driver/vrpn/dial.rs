//! How a client comes to its connection: by calling the server, or by asking it to call back.

use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::time::{Duration, Instant};

use super::place::Place;
use crate::driver::Unavailable;

/// Longest wait for a connection to one address.
const CONNECT: Duration = Duration::from_secs(2);

/// Addresses of one host that are tried.
const ADDRESSES_MAX: usize = 4;

/// Time after which a request to call back is sent again, s.
const ASK_AGAIN_S: f64 = 2.0;

/// Longest wait for the server to call back, s: three requests.
const CALL_BACK_S: f64 = 5.0;

/// Connects to the server.
pub(super) fn dial(place: &Place) -> Result<TcpStream, Unavailable> {
    dial_within(place, CONNECT)
}

/// Connects to the server, or gives up after a time for each of its addresses.
pub(super) fn dial_within(place: &Place, wait: Duration) -> Result<TcpStream, Unavailable> {
    let mut last = None;
    for address in resolve(place)?.into_iter().take(ADDRESSES_MAX) {
        match TcpStream::connect_timeout(&address, wait) {
            Ok(stream) => return Ok(stream),
            Err(e) => last = Some(e),
        }
    }
    Err(match last {
        Some(e) => nobody(place, &e),
        None => not_there(place, "the host has no address"),
    })
}

fn resolve(place: &Place) -> Result<Vec<SocketAddr>, Unavailable> {
    match (place.host.as_str(), place.port).to_socket_addrs() {
        Ok(addresses) => Ok(addresses.collect()),
        Err(e) => Err(not_there(place, &format!("the host is not known ({e})"))),
    }
}

fn nobody(place: &Place, error: &std::io::Error) -> Unavailable {
    match error.kind() {
        ErrorKind::ConnectionRefused => not_there(place, "nobody listens at this port"),
        ErrorKind::TimedOut => not_there(place, "the host does not answer"),
        _ => not_there(place, &error.to_string()),
    }
}

fn not_there(place: &Place, why: &str) -> Unavailable {
    Unavailable::NotThere {
        reason: format!(
            "no VRPN server at {}: {why}; start the server, check host and port (usually 3883), and that no \
             firewall is between",
            place.server()
        ),
    }
}

/// Asks the server to call back, again and again, and waits for the call.
pub(super) fn call_back(place: &Place) -> Result<TcpStream, Unavailable> {
    call_back_within(place, ASK_AGAIN_S, CALL_BACK_S)
}

fn call_back_within(
    place: &Place,
    ask_again_s: f64,
    wait_s: f64,
) -> Result<TcpStream, Unavailable> {
    // The request has room for an address of version 4 alone.
    let server = resolve(place)?.into_iter().find(SocketAddr::is_ipv4);
    let server = server.ok_or_else(|| {
        not_there(
            place,
            "the host has no IPv4 address, which calling back needs; use vrpn:tcp://",
        )
    })?;
    let own = |e: std::io::Error| not_there(place, &format!("no socket to be called at: {e}"));
    let asking = UdpSocket::bind(("0.0.0.0", 0)).map_err(own)?;
    asking.connect(server).map_err(|e| nobody(place, &e))?;
    asking.set_nonblocking(true).map_err(own)?;
    let own_ip = asking.local_addr().map_err(own)?.ip();
    let listener = TcpListener::bind((own_ip, 0)).map_err(own)?;
    listener.set_nonblocking(true).map_err(own)?;
    let port = listener.local_addr().map_err(own)?.port();

    let request = format!("{own_ip} {port}\0");
    let begun = Instant::now();
    let mut asked_at: Option<Instant> = None;
    let mut stranger = None;
    while begun.elapsed().as_secs_f64() < wait_s {
        if asked_at.is_none_or(|at| at.elapsed().as_secs_f64() > ask_again_s) {
            asked_at = Some(Instant::now());
            asking
                .send(request.as_bytes())
                .map_err(|e| nobody(place, &e))?;
        }
        match listener.accept() {
            Ok((stream, from)) if from.ip() == server.ip() => return Ok(stream),
            Ok((_, from)) => stranger = Some(from.ip()),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
        // The system's word that the port is closed.
        if let Err(e) = asking.recv(&mut [0; 1])
            && e.kind() == ErrorKind::ConnectionRefused
        {
            return Err(nobody(place, &e));
        }
    }
    Err(not_there(
        place,
        &nobody_called(own_ip, port, wait_s, stranger),
    ))
}

fn nobody_called(own: IpAddr, port: u16, wait_s: f64, stranger: Option<IpAddr>) -> String {
    let stranger = stranger.map_or_else(String::new, |ip| {
        format!(" (only {ip} called, which is not the server's address)")
    });
    format!(
        "it was asked to call {own} port {port} and has not within {wait_s} s{stranger}; \
         vrpn:tcp:// needs no call"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn server_that_never_calls_back_is_asked_again_and_then_not_there() {
        let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = silent.local_addr().unwrap();
        let place = Place::parse(&format!("udp://Hand0@{address}")).unwrap();
        let error = call_back_within(&place, 0.01, 0.1).unwrap_err().to_string();
        assert!(error.contains("asked to call 127.0.0.1 port"), "{error}");
        assert!(error.contains(&address.to_string()), "{error}");
        let mut request = [0; 64];
        for _ in 0..2 {
            let count = silent.recv(&mut request).unwrap();
            assert!(request[..count].starts_with(b"127.0.0.1 "));
            assert_eq!(request[count - 1], 0);
        }
    }
}
