//! A server for one page and one state, on the loopback address only.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Longest request that is read, bytes.
const LONGEST_REQUEST: usize = 8192;
/// Time for a request or an answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Largest number of clients that are answered at the same time; further ones are turned away.
const MOST_CLIENTS: usize = 32;

/// Serves the page until it is dropped.
pub(in crate::program) struct Server {
    address: SocketAddr,
    state: Arc<Mutex<Arc<str>>>,
    ended: Arc<AtomicBool>,
}

impl Server {
    /// Listens on `port` of 127.0.0.1; 0 takes any free port.
    pub(super) fn start(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let address = listener.local_addr()?;
        let state: Arc<Mutex<Arc<str>>> = Arc::new(Mutex::new("{}".into()));
        let ended = Arc::new(AtomicBool::new(false));
        let (shared, end) = (Arc::clone(&state), Arc::clone(&ended));
        let open = Arc::new(AtomicUsize::new(0));
        std::thread::Builder::new().name("watch".into()).spawn(move || {
            for stream in listener.incoming() {
                if end.load(Ordering::Relaxed) {
                    return;
                }
                let Ok(stream) = stream else { continue };
                let (shared, open) = (Arc::clone(&shared), Arc::clone(&open));
                if open.fetch_add(1, Ordering::Relaxed) >= MOST_CLIENTS {
                    open.fetch_sub(1, Ordering::Relaxed);
                    continue;
                }
                // A client that is slow or goes away concerns only itself.
                let client = std::thread::Builder::new().name("watch client".into());
                let begun = client.spawn({
                    let open = Arc::clone(&open);
                    move || {
                        let _ = answer(stream, &shared);
                        open.fetch_sub(1, Ordering::Relaxed);
                    }
                });
                if begun.is_err() {
                    open.fetch_sub(1, Ordering::Relaxed);
                }
            }
        })?;
        Ok(Self { address, state, ended })
    }

    pub(super) fn address(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Replaces the state.
    pub(super) fn publish(&self, text: String) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = text.into();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        // The thread waits for a connection.
        let _ = TcpStream::connect_timeout(&self.address, PATIENCE);
    }
}

fn answer(mut stream: TcpStream, state: &Mutex<Arc<str>>) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut request = Vec::new();
    let mut part = [0; 1024];
    while !request.windows(4).any(|end| end == b"\r\n\r\n") {
        let count = stream.read(&mut part)?;
        if count == 0 || request.len() + count > LONGEST_REQUEST {
            return Ok(());
        }
        request.extend_from_slice(&part[..count]);
    }
    let request = String::from_utf8_lossy(&request);
    let (status, kind, body): (_, _, Arc<str>) = match (is_local(&request), request.split(' ').nth(1)) {
        (false, _) => ("403 Forbidden", "text/plain", "only for this computer\n".into()),
        (true, Some("/")) if request.starts_with("GET ") => ("200 OK", "text/html", include_str!("page.html").into()),
        (true, Some("/state")) if request.starts_with("GET ") => {
            let state = Arc::clone(&state.lock().unwrap_or_else(PoisonError::into_inner));
            ("200 OK", "application/json", state)
        }
        _ => ("404 Not Found", "text/plain", "not here\n".into()),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body.as_bytes())
}

/// Whether a browser asks by a name of this computer, at any port: a tunnel (`ssh -L 9000:localhost:PORT`) has another one. Pages of other
/// sites that resolve their name to 127.0.0.1 cannot read the state.
fn is_local(request: &str) -> bool {
    let host = request.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.eq_ignore_ascii_case("host").then(|| value.trim())
    });
    let Some(host) = host else { return false };
    let (name, port) = host.rsplit_once(':').filter(|(name, _)| *name != "[:").unwrap_or((host, "80"));
    ["127.0.0.1", "localhost", "[::1]"].iter().any(|own| name.eq_ignore_ascii_case(own)) && port.parse::<u16>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn get(address: SocketAddr, path: &str, host: &str) -> String {
        let mut stream = TcpStream::connect(address).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn it_serves_this_computer_only() {
        let server = Server::start(0).unwrap();
        let (address, host) = (server.address, format!("127.0.0.1:{}", server.address.port()));
        assert!(address.ip().is_loopback());
        assert!(get(address, "/", &host).contains("<title>"));
        assert!(get(address, "/state", &host).ends_with("\r\n\r\n{}"));
        server.publish("{\"a\": 1}".into());
        assert!(get(address, "/state", &host).ends_with("{\"a\": 1}"));
        assert!(get(address, "/etc/passwd", &host).starts_with("HTTP/1.1 404"));
        // A tunnel has another port.
        for host in ["localhost:9000", "LOCALHOST:9000", "127.0.0.1:1", "localhost", "[::1]:9000", "[::1]"] {
            assert!(get(address, "/state", host).starts_with("HTTP/1.1 200"), "{host}");
        }
        let port = address.port();
        for host in [
            "evil.example",
            &format!("evil.example:{port}"),
            "127.0.0.1.evil.example:80",
            "localhost.evil.example",
            "localhost:80.evil.example",
            "",
        ] {
            assert!(get(address, "/state", host).starts_with("HTTP/1.1 403"), "{host}");
        }
        drop(server);
        // The port is free again, as soon as the thread has ended.
        let start = std::time::Instant::now();
        while TcpListener::bind(address).is_err() {
            assert!(start.elapsed() < PATIENCE, "the port stays open");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
    /// Clients that say nothing, or read nothing, keep nobody else waiting.
    #[test]
    fn a_slow_client_waits_alone() {
        let server = Server::start(0).unwrap();
        let silent: Vec<TcpStream> = (0..4).map(|_| TcpStream::connect(server.address).unwrap()).collect();
        let begun = std::time::Instant::now();
        assert!(get(server.address, "/state", "localhost").starts_with("HTTP/1.1 200"));
        assert!(begun.elapsed() < PATIENCE, "the page waits for others");
        drop(silent);
    }
}
