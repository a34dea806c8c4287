//! The page of a running specimen.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

use concordem::program::exit;
use concordem_tests::commands::{concordem, text};
use tempfile::TempDir;

use crate::prism;

/// The answer to a request; `None` while nobody listens.
pub(crate) fn get(port: u16, path: &str) -> Option<String> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n").ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    Some(answer)
}

/// A port that is free now.
pub(crate) fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|port| port.local_addr()).expect("a port").port()
}

/// The page shows the run while it goes on, with particles and curve. Watching changes no bit of the result.
#[test]
fn a_run_can_be_watched_and_does_not_change() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 4000);
    let port = free_port();
    let watched = folder.path().join("watched.h5");
    let number = port.to_string();
    let run = ["run", "-q", text(&scenario), "-o", text(&watched), "--watch", &number];
    let mut child = crate::spawn(&run);
    let mut state = String::new();
    let mut page = None;
    while child.try_wait().expect("a child").is_none() {
        page = page.or_else(|| get(port, "/"));
        if let Some(answer) = get(port, "/state").filter(|answer| answer.contains("\"curve\"")) {
            state = answer;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(page.expect("a page").contains("<canvas id=\"slice\""));
    let (head, body) = state.split_once("\r\n\r\n").expect("a state");
    assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
    let state: serde_json::Value = serde_json::from_str(body).expect("JSON");
    assert_eq!(state["title"], "Prism");
    assert!(state["curve"].as_array().is_some_and(|curve| !curve.is_empty()), "{body}");
    assert!(state["particles"].as_str().is_some_and(|particles| particles.len() > 100), "{body}");
    let alone = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let hash = |path: &std::path::Path| concordem(["info", "--hash", text(path)]).out;
    assert_eq!(hash(&watched), hash(&alone));
}

/// `concordem watch` shows a run that was started without `--watch`, ends with it, and changes no bit of it.
#[test]
fn a_run_can_be_watched_from_another_process() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 6000);
    let watched = folder.path().join("watched.h5");
    let mut run = crate::spawn(&["run", "-q", text(&scenario), "-o", text(&watched)]);
    let parts = folder.path().join("watched.h5.parts");
    while !parts.join("checkpoint-0001.h5").exists() {
        assert!(run.try_wait().expect("a child").is_none(), "the run ended before it could be watched");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let port = free_port();
    let number = port.to_string();
    let mut watch = crate::spawn(&["watch", text(&watched), "--port", &number]);
    let (mut states, mut page) = (Vec::new(), None);
    let code = loop {
        page = page.or_else(|| get(port, "/"));
        if let Some(answer) = get(port, "/state").filter(|answer| answer.contains("\"curve\"")) {
            let (_, body) = answer.split_once("\r\n\r\n").expect("a body");
            states.push(serde_json::from_str::<serde_json::Value>(body).expect("JSON"));
        }
        if let Some(status) = watch.try_wait().expect("a child") {
            break status.code();
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    };
    assert_eq!(code, Some(i32::from(exit::DONE)), "`concordem watch` ends with the run");
    assert!(run.wait().expect("a child").success());
    assert!(page.expect("a page").contains("<canvas id=\"slice\""));
    let state = states.last().expect("a state");
    assert_eq!(state["title"], "Prism");
    assert!(state["curve"].as_array().is_some_and(|curve| curve.len() > 1), "{state}");
    assert!(state["particles"].as_str().is_some_and(|particles| particles.len() > 100), "{state}");
    assert!(state["share"].as_f64().is_some_and(|share| share > 0.0 && share <= 1.0), "{state}");
    let alone = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let hash = |path: &std::path::Path| concordem(["info", "--hash", text(path)]).out;
    assert_eq!(hash(&watched), hash(&alone));
}

/// What does not go on is refused, with the command that helps.
#[test]
fn only_a_run_that_goes_on_is_watched() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 20);
    let missing = concordem(["watch", text(&folder.path().join("no.h5"))]);
    assert_eq!(missing.code, exit::USAGE);
    assert!(missing.err.contains("no process runs"), "{}", missing.err);
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    for file in [folder.path().join("prism.h5"), scenario] {
        let finished = concordem(["watch", text(&file)]);
        assert_eq!(finished.code, exit::USAGE);
        assert!(finished.err.contains("concordem report"), "{}", finished.err);
    }
}
