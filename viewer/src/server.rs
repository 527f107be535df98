//! The server that gives out recordings and the viewer.

use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use maud::{DOCTYPE, html};

use crate::WebViewer;

/// The page that a campaign writes of its recordings.
const CAMPAIGN_PAGE: &str = "recordings/index.html";
/// Time after which a silent connection is closed.
const SILENCE: Duration = Duration::from_secs(30);
/// First bytes of a recording, before the version of its format.
const MAGIC: &[u8] = b"RRF";
/// Largest number of header lines that are read.
const MAX_HEADER_LINES: usize = 100;

/// The reason why nothing can be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The path has no recording.
    #[error("failed to find a recording in {path}: name a file .rrd, or a folder that has such files")]
    Nothing {
        /// The path.
        path: PathBuf,
    },
    /// The file has the name of a recording, but is none.
    #[error("failed to open {path}: the file is no recording, which begins with the letters RRF")]
    Foreign {
        /// The path.
        path: PathBuf,
    },
    /// The path cannot be read.
    #[error("failed to read {path}: {source}")]
    Read {
        /// The path.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The port is not free.
    #[error("failed to listen on 127.0.0.1:{port}: {source}")]
    Listen {
        /// The port.
        port: u16,
        /// The reason.
        source: io::Error,
    },
}

/// A server on the loopback address.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    site: Arc<Site>,
}

/// What is given out.
#[derive(Debug)]
struct Site {
    port: u16,
    folder: PathBuf,
    /// The recordings, relative to the folder.
    recordings: Vec<String>,
    /// True if the folder has a campaign's page of its recordings.
    has_page: bool,
    viewer: WebViewer,
}

/// An answer: status line, type, body, and further header lines.
struct Answer {
    status: &'static str,
    content_type: &'static str,
    body: Vec<u8>,
    header: String,
}

impl Server {
    /// Creates a server for a recording or for a folder with recordings. With port 0 the system chooses one.
    ///
    /// # Errors
    /// [`ServeError`] if the path has no recording, or the port is not free.
    pub fn new(path: &Path, port: u16, viewer: WebViewer) -> Result<Self, ServeError> {
        let (folder, recordings) = recordings(path)?;
        let listen = |source| ServeError::Listen { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(listen)?;
        let port = listener.local_addr().map_err(listen)?.port();
        let has_page = path.is_dir() && folder.join(CAMPAIGN_PAGE).is_file();
        Ok(Self { listener, site: Arc::new(Site { port, folder, recordings, has_page, viewer }) })
    }

    /// Checks that a path has a recording.
    ///
    /// # Errors
    /// [`ServeError`] if it has none.
    pub fn check(path: &Path) -> Result<(), ServeError> {
        recordings(path).map(drop)
    }

    /// Returns the address of the server.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.site.port)
    }

    /// Answers requests until the program ends.
    pub fn run(&self) {
        for stream in self.listener.incoming().flatten() {
            let site = Arc::clone(&self.site);
            thread::spawn(move || drop(site.serve(stream)));
        }
    }
}

/// Returns the folder that is given out and its recordings. A file stands for itself only.
fn recordings(path: &Path) -> Result<(PathBuf, Vec<String>), ServeError> {
    let read = |source| ServeError::Read { path: path.to_owned(), source };
    let nothing = || ServeError::Nothing { path: path.to_owned() };
    let whole = path.canonicalize().map_err(read)?;
    if whole.is_file() {
        let (Some(folder), Some(name)) = (whole.parent(), whole.file_name().and_then(|name| name.to_str())) else {
            return Err(nothing());
        };
        if !is_recording(name) {
            return Err(nothing());
        }
        let mut start = Vec::new();
        fs::File::open(&whole).and_then(|file| file.take(MAGIC.len() as u64).read_to_end(&mut start)).map_err(read)?;
        if start != MAGIC {
            return Err(ServeError::Foreign { path: path.to_owned() });
        }
        return Ok((folder.to_owned(), vec![name.to_owned()]));
    }
    let mut found = Vec::new();
    for below in ["", "recordings/"] {
        let Ok(entries) = fs::read_dir(whole.join(below)) else { continue };
        let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
        found.extend(names.filter(|name| is_recording(name)).map(|name| format!("{below}{name}")));
    }
    found.sort();
    if found.is_empty() { Err(nothing()) } else { Ok((whole, found)) }
}

fn is_recording(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension == "rrd")
}

impl Site {
    /// Answers one request.
    fn serve(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_read_timeout(Some(SILENCE))?;
        let mut reader = BufReader::new(stream.try_clone()?);
        let mut request = String::new();
        reader.read_line(&mut request)?;
        let mut host = String::new();
        for _ in 0..MAX_HEADER_LINES {
            let mut line = String::new();
            if reader.read_line(&mut line)? == 0 || line.trim().is_empty() {
                break;
            }
            if let Some((name, value)) = line.split_once(':')
                && name.eq_ignore_ascii_case("host")
            {
                host = value.trim().to_owned();
            }
        }
        let mut words = request.split(' ');
        let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        // A page from elsewhere that has its name point to this machine has another host.
        let is_local = ["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{}", self.port));
        let answer = match method {
            _ if !is_local => refusal("403 Forbidden"),
            "GET" | "HEAD" => self.answer(target.split(['?', '#']).next().unwrap_or_default()),
            _ => refusal("405 Method Not Allowed"),
        };
        write!(
            stream,
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{}Connection: close\r\n\r\n",
            answer.status,
            answer.content_type,
            answer.body.len(),
            answer.header
        )?;
        if method != "HEAD" {
            stream.write_all(&answer.body)?;
        }
        stream.flush()
    }

    fn answer(&self, path: &str) -> Answer {
        if path == "/" {
            return self.entrance();
        }
        if let Some(name) = path.strip_prefix("/viewer/") {
            return self.viewer.file(name).map_or_else(not_found, |bytes| found(name, bytes.to_owned()));
        }
        let Some(name) = path.strip_prefix("/files/").and_then(decoded) else { return not_found() };
        // A single recording gives out no other file of its folder.
        let is_open = self.recordings.contains(&name) || self.has_page && name == CAMPAIGN_PAGE;
        let plain = Path::new(&name).components().all(|part| matches!(part, Component::Normal(_)));
        if !is_open || !plain {
            return not_found();
        }
        fs::read(self.folder.join(&name)).map_or_else(|_| not_found(), |bytes| found(&name, bytes))
    }

    /// Returns the way to the only recording, to a campaign's page, or a list of the recordings.
    fn entrance(&self) -> Answer {
        let target = match &self.recordings[..] {
            _ if self.has_page => format!("/files/{CAMPAIGN_PAGE}"),
            [only] => self.link(only),
            all => {
                let page = html! {
                    (DOCTYPE)
                    html lang="en" {
                        head { meta charset="utf-8"; title { "Recordings" } }
                        body {
                            h1 { "Recordings" }
                            ul { @for name in all { li { a href=(self.link(name)) { (name) } } } }
                        }
                    }
                };
                return found("index.html", page.into_string().into_bytes());
            }
        };
        Answer { header: format!("Location: {target}\r\n"), ..refusal("302 Found") }
    }

    /// Returns the link that opens a recording in the viewer.
    fn link(&self, name: &str) -> String {
        let address = format!("http://127.0.0.1:{}/files/{}", self.port, encoded(name));
        format!("/viewer/?url={}", encoded(&address))
    }
}

fn found(name: &str, body: Vec<u8>) -> Answer {
    let extension = Path::new(name).extension().and_then(|extension| extension.to_str());
    let content_type = match extension {
        None | Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    };
    Answer { status: "200 OK", content_type, body, header: String::new() }
}

fn refusal(status: &'static str) -> Answer {
    Answer { status, content_type: "text/plain", body: status.as_bytes().to_owned(), header: String::new() }
}

fn not_found() -> Answer {
    refusal("404 Not Found")
}

/// Returns a text as part of a URL.
fn encoded(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.~/".contains(&byte);
    let mut url = String::new();
    for byte in text.bytes() {
        if plain(byte) { url.push(char::from(byte)) } else { url.push_str(&format!("%{byte:02X}")) }
    }
    url
}

/// Returns the text of a part of a URL, or `None` if it is not UTF-8 or wrongly encoded.
fn decoded(url: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = url.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let digits = [rest.next()?, rest.next()?];
        bytes.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_survives_encoding_and_decoding() {
        for name in ["recordings/a b-3.rrd", "é%.rrd", "plain.rrd"] {
            assert_eq!(decoded(&encoded(name)).as_deref(), Some(name));
        }
        assert_eq!(decoded("%4"), None);
        assert_eq!(decoded("%zz"), None);
    }

    #[test]
    fn a_folder_without_recordings_is_refused_and_one_with_them_lists_both_levels() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(recordings(folder.path()), Err(ServeError::Nothing { .. })));
        fs::create_dir(folder.path().join("recordings")).unwrap();
        for name in ["b.rrd", "recordings/a.rrd", "notes.txt"] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        assert_eq!(recordings(folder.path()).unwrap().1, ["b.rrd", "recordings/a.rrd"]);
        assert!(matches!(recordings(&folder.path().join("notes.txt")), Err(ServeError::Nothing { .. })));
        assert!(matches!(recordings(&folder.path().join("none.rrd")), Err(ServeError::Read { .. })));
        assert!(matches!(recordings(&folder.path().join("b.rrd")), Err(ServeError::Foreign { .. })));
        fs::write(folder.path().join("b.rrd"), "RRF2").unwrap();
        assert_eq!(recordings(&folder.path().join("b.rrd")).unwrap().1, ["b.rrd"]);
    }
}
