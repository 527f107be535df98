//! A server of pages for one user of this machine.
//!
//! ```text
//!  http://127.0.0.1:PORT/TOKEN/PATH
//!                        └ 128 random bits: who does not know them gets nothing
//! ```
//!
//! It listens on the loopback alone. Each connection carries one request without a body. The number
//! of connections, the length of a request and the time for it are bounded, and a request must name
//! this server as its host, so that no page of another site reads through a name that leads here
//! (DNS rebinding).
//!
//! `httparse` reads the requests: the parser of hyper, which other dependencies have already.
//! `tiny_http` starts a thread for each connection without a bound, and waits for a request without
//! end; hyper's server would need an asynchronous runtime.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Largest number of connections at one time. A browser opens six to one server.
const MOST_CONNECTIONS: usize = 16;
/// Largest length of a request (bytes), and largest number of its headers. Browsers send less than
/// 2 KiB and 30 headers.
const MOST_BYTES: usize = 16 << 10;
const MOST_HEADERS: usize = 64;
/// Time within which a request must be complete.
const REQUEST_TIME: Duration = Duration::from_secs(5);
/// Time for which a browser may not read on.
const WRITE_TIME: Duration = Duration::from_secs(30);
/// Random bytes of the token.
const TOKEN_BYTES: usize = 16;

/// The method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// Something to show.
    Get,
    /// Something to do.
    Post,
}

/// The answer to a request.
#[derive(Debug)]
pub(super) struct Answer {
    /// The status, as in `404 Not Found`.
    pub(super) status: &'static str,
    /// The media type.
    pub(super) kind: &'static str,
    /// More headers, each with its end of line.
    pub(super) headers: &'static str,
    pub(super) body: Vec<u8>,
}

impl Answer {
    /// Returns a text.
    pub(super) fn text(status: &'static str, text: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", headers: "", body: text.into().into_bytes() }
    }

    /// Returns that there is nothing.
    pub(super) fn missing() -> Self {
        Self::text("404 Not Found", "there is no such page")
    }
}

/// A server that listens.
#[derive(Debug)]
pub(super) struct PageServer {
    listener: TcpListener,
    port: u16,
    token: String,
}

impl PageServer {
    /// Listens on a free port of the loopback.
    pub(super) fn bind() -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let port = listener.local_addr()?.port();
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { listener, port, token })
    }

    /// Returns the address of the first page.
    pub(super) fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Answers requests for ever. `answer` gets the part of the path behind the token, with its
    /// percent-encoded characters decoded.
    pub(super) fn serve(&self, answer: &(dyn Fn(Method, &str) -> Answer + Sync)) -> io::Result<()> {
        let open = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for stream in self.listener.incoming() {
                // A connection that ends at once is none.
                let Ok(stream) = stream else { continue };
                if open.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
                    open.fetch_sub(1, Ordering::SeqCst);
                    continue;
                }
                let open = &open;
                scope.spawn(move || {
                    // What the browser does not read is not wanted.
                    drop(self.connection(stream, answer));
                    open.fetch_sub(1, Ordering::SeqCst);
                });
            }
        });
        Ok(())
    }

    fn connection(&self, mut stream: TcpStream, answer: &(dyn Fn(Method, &str) -> Answer + Sync)) -> io::Result<()> {
        stream.set_write_timeout(Some(WRITE_TIME))?;
        let answer = match read_head(&mut stream)? {
            Some(head) => self.answered(&head, answer),
            None => Answer::text("431 Request Header Fields Too Large", "the request is too long"),
        };
        let Answer { status, kind, headers, body } = answer;
        let length = body.len();
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nX-Frame-Options: DENY\r\n{headers}\r\n"
        );
        stream.write_all(head.as_bytes())?;
        stream.write_all(&body)?;
        stream.flush()
    }

    fn answered(&self, head: &[u8], answer: &(dyn Fn(Method, &str) -> Answer + Sync)) -> Answer {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let is_complete = request.parse(head).is_ok_and(|status| status.is_complete());
        let (true, Some(method), Some(path)) = (is_complete, request.method, request.path) else {
            return Answer::text("400 Bad Request", "the request cannot be read");
        };
        let header = |name: &str| {
            let mut values = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
            values.next().map(|header| String::from_utf8_lossy(header.value).into_owned())
        };
        let addresses = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        if !header("host").is_some_and(|host| addresses.contains(&host)) {
            return Answer::text("421 Misdirected Request", "the request names another host");
        }
        if header("transfer-encoding").is_some() || header("content-length").is_some_and(|length| length != "0") {
            return Answer::text("413 Content Too Large", "a request has no body");
        }
        let method = match method {
            "GET" => Method::Get,
            "POST" => Method::Post,
            _ => return Answer::text("405 Method Not Allowed", "only GET and POST are answered"),
        };
        let is_own = |origin: String| addresses.iter().any(|address| origin == format!("http://{address}"));
        if method == Method::Post && !header("origin").is_some_and(is_own) {
            return Answer::text("403 Forbidden", "the request comes from another site");
        }
        let path = path.split('?').next().unwrap_or_default();
        let Some((token, rest)) = path.strip_prefix('/').and_then(|path| path.split_once('/')) else {
            return Answer::missing();
        };
        // Hashes are compared in constant time.
        if blake3::hash(token.as_bytes()) != blake3::hash(self.token.as_bytes()) {
            return Answer::missing();
        }
        decoded(rest).map_or_else(Answer::missing, |rest| answer(method, &rest))
    }
}

/// Reads a request until its empty line. `None` if it is too long.
fn read_head(stream: &mut TcpStream) -> io::Result<Option<Vec<u8>>> {
    let start = Instant::now();
    let (mut head, mut part) = (Vec::new(), [0; 1024]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        if head.len() > MOST_BYTES {
            return Ok(None);
        }
        // One byte after the other does not make the time longer.
        let left = REQUEST_TIME.checked_sub(start.elapsed()).filter(|left| !left.is_zero());
        stream.set_read_timeout(Some(left.ok_or(io::ErrorKind::TimedOut)?))?;
        match stream.read(&mut part)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => head.extend_from_slice(&part[..count]),
        }
    }
    Ok(Some(head))
}

/// Returns a path with its percent-encoded characters decoded. `None` if it is not UTF-8, or an
/// encoding is cut.
fn decoded(path: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            bytes.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends a request, and returns the whole answer.
    fn ask(port: u16, request: &[u8]) -> String {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        // A server that has refused the request reads no more of it.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn server() -> (&'static PageServer, u16) {
        let server: &'static PageServer = Box::leak(Box::new(PageServer::bind().unwrap()));
        std::thread::spawn(|| server.serve(&|method, path| Answer::text("200 OK", format!("{method:?} {path}"))));
        (server, server.port)
    }

    #[test]
    fn only_who_knows_the_token_and_names_this_host_gets_an_answer() {
        let (server, port) = server();
        let (token, host) = (&server.token, format!("Host: 127.0.0.1:{port}\r\n"));
        let status = |request: &str, headers: &str| {
            let answer = ask(port, format!("{request} HTTP/1.1\r\n{headers}\r\n").as_bytes());
            answer.split_whitespace().nth(1).unwrap_or("none").to_owned()
        };
        assert!(ask(port, format!("GET /{token}/a%20b?x HTTP/1.1\r\n{host}\r\n").as_bytes()).ends_with("Get a b"));
        for (request, headers, expected) in [
            (format!("GET /{token}/"), host.clone(), "200"),
            (format!("GET /{}/", "0".repeat(32)), host.clone(), "404"),
            (format!("GET /{}/", &token[..31]), host.clone(), "404"),
            ("GET /".to_owned(), host.clone(), "404"),
            (format!("GET /{token}"), host.clone(), "404"),
            (format!("GET /{token}/%f"), host.clone(), "404"),
            (format!("GET /{token}/%ff"), host.clone(), "404"),
            (format!("GET /{token}/"), format!("Host: evil.example:{port}\r\n"), "421"),
            (format!("GET /{token}/"), String::new(), "421"),
            (format!("DELETE /{token}/"), host.clone(), "405"),
            (format!("POST /{token}/"), host.clone(), "403"),
            (format!("POST /{token}/"), format!("{host}Origin: http://evil.example\r\n"), "403"),
            (format!("POST /{token}/"), format!("{host}Origin: http://127.0.0.1:{port}\r\n"), "200"),
            (format!("GET /{token}/"), format!("{host}Content-Length: 9\r\n"), "413"),
            (format!("GET /{token}/"), format!("{host}Transfer-Encoding: chunked\r\n"), "413"),
            (format!("GET /{token}/"), format!("{host}{}", "a: b\r\n".repeat(100)), "400"),
            (format!("GET /{}", "a".repeat(MOST_BYTES + 2_000)), host, "431"),
        ] {
            assert_eq!(status(&request, &headers), expected, "{request:.60} {headers:.60}");
        }
        assert_eq!(ask(port, b"\0\xff\r\n\r\n").split_whitespace().nth(1), Some("400"));
    }

    #[test]
    fn connections_without_a_request_are_bounded_and_end() {
        let (server, port) = server();
        let mut waiting: Vec<TcpStream> =
            (0..3 * MOST_CONNECTIONS).filter_map(|_| TcpStream::connect((Ipv4Addr::LOCALHOST, port)).ok()).collect();
        // One byte now and then keeps no connection open.
        for stream in &mut waiting {
            let _ = stream.write_all(b"G");
            stream.set_read_timeout(Some(4 * REQUEST_TIME)).unwrap();
        }
        let is_waiting = |kind| matches!(kind, io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut);
        for stream in &mut waiting {
            match stream.read(&mut [0; 8]) {
                Ok(read) => assert_eq!(read, 0, "there is no answer without a request"),
                Err(error) => assert!(!is_waiting(error.kind()), "the connection is still open"),
            }
        }
        let request = format!("GET /{}/x HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n", server.token);
        assert!(ask(port, request.as_bytes()).ends_with("Get x"), "the server answers again");
    }

    #[test]
    fn the_server_listens_on_the_loopback_alone_and_each_has_its_own_token() {
        let (first, second) = (PageServer::bind().unwrap(), PageServer::bind().unwrap());
        assert!(first.listener.local_addr().unwrap().ip().is_loopback());
        assert_ne!(first.token, second.token);
        assert_eq!(first.token.len(), 2 * TOKEN_BYTES);
    }
}
