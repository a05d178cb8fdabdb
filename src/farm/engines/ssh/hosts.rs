//! The file of hosts: one machine a line.
//!
//! ```text
//! # processes  login                          folder
//! 4            :
//! 8            alice@node1
//! 16           bob@node2:2222                 /scratch/room
//! 2            "-i keys/id -J gate carol@n3"  "/data/my room"
//! ```
//!
//! `:` is this machine. A login is `[user@]host[:port]`, with options of ssh before it where the field is quoted. A
//! host without a folder sees that of the plan under the same path; a host with one gets a copy of it there.

use crate::error::{Error, Result};
use std::path::Path;
use std::process::Command;

/// Most processes of one host.
const MAX_PROCESSES: u32 = 4096;
/// What GNU parallel would replace in a command.
pub(super) const FORBIDDEN: &str = "{}";
/// Nobody is there to type a password, and a machine that falls silent is given up after some 15 s.
const OPTIONS: [&str; 8] =
    ["-o", "BatchMode=yes", "-o", "ConnectTimeout=10", "-o", "ServerAliveInterval=5", "-o", "ServerAliveCountMax=3"];

/// One machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Host {
    /// Workers at a time.
    pub processes: u32,
    /// How to get there; None for this machine.
    pub login: Option<Login>,
    /// The folder of its copy; None where it sees that of the plan.
    pub folder: Option<String>,
}

/// How to get to a machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Login {
    /// Options of ssh.
    pub options: Vec<String>,
    /// `[user@]host`.
    pub destination: String,
}

impl Login {
    /// ssh with its options, the destination left out.
    pub fn ssh(&self) -> Vec<&str> {
        let options = OPTIONS.into_iter().chain(self.options.iter().map(String::as_str));
        std::iter::once("ssh").chain(options).collect()
    }

    /// The same as words of a shell.
    pub fn ssh_line(&self) -> String {
        shlex::try_join(self.ssh()).expect("no NUL in a line of text")
    }

    /// `ssh ... destination command`, the words of the command quoted for the shell there.
    pub fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new("ssh");
        command.args(&self.ssh()[1..]).arg(&self.destination);
        command.arg(shlex::try_join(words.iter().copied()).expect("no NUL in a line of text"));
        command.stdin(std::process::Stdio::null());
        command
    }
}

impl Host {
    /// As GNU parallel and its jobs call it.
    pub fn name(&self) -> String {
        self.login
            .as_ref()
            .map_or_else(|| ":".to_owned(), |login| format!("{} {}", login.ssh_line(), login.destination))
    }

    /// As people call it.
    pub fn short_name(&self) -> String {
        match &self.login {
            None => "this machine".to_owned(),
            Some(Login { options, destination }) => match &options[..] {
                [.., flag, port] if flag == "-p" => format!("{destination}:{port}"),
                _ => destination.clone(),
            },
        }
    }
}

/// Reads the file of hosts at `path`.
///
/// # Errors
/// [`Error::Input`] with the line and what is allowed there.
pub fn read(path: &Path) -> Result<Vec<Host>> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::input("command line", "--hosts", &file, format!("a file of hosts ({e})")))?;
    parse(&text, &file)
}

fn parse(text: &str, file: &str) -> Result<Vec<Host>> {
    let mut hosts: Vec<Host> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let refused = |allowed: String| Error::input(file, format!("line {number}"), line.escape_debug(), allowed);
        let Some(host) = host(line).map_err(refused)? else { continue };
        if hosts.iter().any(|other| other.name() == host.name()) {
            return Err(refused("each login once; give it more processes".to_owned()));
        }
        hosts.push(host);
    }
    match hosts.is_empty() {
        true => Err(Error::input(file, "hosts", "(none)", "at least one line: processes, login and perhaps folder")),
        false => Ok(hosts),
    }
}

/// The host of one line; None for a line of spaces or a comment.
fn host(line: &str) -> std::result::Result<Option<Host>, String> {
    if line.chars().any(|c| (c.is_control() && c != '\t') || FORBIDDEN.contains(c)) {
        return Err(format!("no control characters and none of {FORBIDDEN}"));
    }
    let fields = shlex::split(line).ok_or("quotation marks in pairs")?;
    let (processes, name, folder) = match &fields[..] {
        [] => return Ok(None),
        [processes, name] => (processes, name, None),
        [processes, name, folder] => (processes, name, Some(folder.clone())),
        _ => return Err("processes, login and perhaps folder; quote a field that has spaces".to_owned()),
    };
    let count = processes.parse().ok().filter(|n| (1..=MAX_PROCESSES).contains(n));
    let processes = count.ok_or_else(|| format!("first the number of processes, 1 .. {MAX_PROCESSES}"))?;
    if folder.as_ref().is_some_and(|f| !f.starts_with('/') || f.trim_end_matches('/').is_empty()) {
        return Err("last a folder from the root: /...".to_owned());
    }
    let login = login(name)?;
    match login.is_none() && folder.is_some() {
        true => Err("no folder for this machine: it has that of the plan".to_owned()),
        false => Ok(Some(Host { processes, login, folder })),
    }
}

fn login(field: &str) -> std::result::Result<Option<Login>, String> {
    if field == ":" {
        return Ok(None);
    }
    let mut options = shlex::split(field).ok_or("quotation marks in pairs")?;
    let last = options.pop().ok_or("a login")?;
    let (destination, port) = match last.split_once(':') {
        Some((destination, port)) => (destination, Some(port)),
        None => (last.as_str(), None),
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let word = |w: &str| !w.is_empty() && !w.starts_with('-') && w.chars().all(plain);
    if !destination.split('@').all(word) || destination.split('@').count() > 2 {
        return Err(
            "a login such as user@host, user@host:22, a name in ~/.ssh/config, or : for this machine".to_owned()
        );
    }
    if let Some(port) = port {
        let known = port.parse::<u16>().ok().filter(|&p| p > 0);
        options.extend(["-p".to_owned(), known.ok_or("a port, 1 .. 65535")?.to_string()]);
    }
    Ok(Some(Login { options, destination: destination.to_owned() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_a_line_is_read() {
        let text = "\
# processes login folder
4\t:   # here

8 alice@node1
16 bob@node2:2222 /scratch/room
2 \"-i 'my keys/id' -J gate carol@n3\" \"/data/my room\"
";
        let hosts = parse(text, "hosts").unwrap();
        let login = |options: &[&str], destination: &str| {
            Some(Login {
                options: options.iter().map(|s| s.to_string()).collect(),
                destination: destination.to_owned(),
            })
        };
        let host =
            |processes, login, folder: Option<&str>| Host { processes, login, folder: folder.map(str::to_owned) };
        let expected = [
            host(4, None, None),
            host(8, login(&[], "alice@node1"), None),
            host(16, login(&["-p", "2222"], "bob@node2"), Some("/scratch/room")),
            host(2, login(&["-i", "my keys/id", "-J", "gate"], "carol@n3"), Some("/data/my room")),
        ];
        assert_eq!(hosts, expected);
        assert_eq!(hosts[0].name(), ":");
        let names: Vec<String> = hosts.iter().map(Host::short_name).collect();
        assert_eq!(names, ["this machine", "alice@node1", "bob@node2:2222", "carol@n3"]);
        assert!(hosts[3].name().ends_with("-i 'my keys/id' -J gate carol@n3"), "{}", hosts[3].name());
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, fragment) in [
            ("", "hosts = (none): at least one line"),
            ("# nobody\n", "at least one line"),
            ("4 a\nx b\n", "line 2 = x b: first the number of processes, 1 .. 4096"),
            ("0 a", "1 .. 4096"),
            ("4", "processes, login and perhaps folder"),
            ("4 a /b c", "quote a field"),
            ("4 a b", "a folder from the root"),
            ("4 a /", "a folder from the root"),
            ("4 : /b", "no folder for this machine"),
            ("4 -oProxyCommand=evil", "a login such as user@host"),
            ("4 a@b@c", "a login such as"),
            ("4 a;b", "a login such as"),
            ("4 a:0", "a port, 1 .. 65535"),
            ("4 a:1:2", "a port"),
            ("4 \"a", "quotation marks in pairs"),
            ("4 a /b{}", "none of {}"),
            ("4 a\n2 a", "each login once"),
        ] {
            let said = parse(text, "hosts").unwrap_err().to_string();
            assert!(said.starts_with("hosts: ") && said.contains(fragment), "{text}: {said}");
        }
    }
}
