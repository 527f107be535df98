//! A minimal HTTP client for files of a server on this machine.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpStream};

/// Returns the body of the file at `path` on the local server at `port`, or an error if its status is not 200.
pub(super) fn get(port: u16, path: &str) -> io::Result<Vec<u8>> {
    let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
    // With HTTP/1.0 the end of the connection is the end of the body.
    write!(stream, "GET {path} HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    const END_OF_HEAD: &[u8] = b"\r\n\r\n";
    let end = answer.windows(END_OF_HEAD.len()).position(|bytes| bytes == END_OF_HEAD);
    let end = end.ok_or_else(|| io::Error::other("the answer has no body"))?;
    let status = String::from_utf8_lossy(&answer[..end]);
    let status = status.lines().next().unwrap_or_default().to_owned();
    if status.split(' ').nth(1) != Some("200") {
        return Err(io::Error::other(format!("{path}: {status}")));
    }
    answer.drain(..end + END_OF_HEAD.len());
    Ok(answer)
}
