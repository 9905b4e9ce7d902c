//! Hosts of their own, as far as the network is concerned: namespaces behind links of a given speed.
//!
//! Each has an address, a route to the others through this machine, and a token bucket at either end
//! of its link (tc-tbf(8)). Needs root and iproute2.

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use kilauea_cluster::Ticket;

use crate::measured::Outcome;

/// Where all of them find this machine.
pub(crate) const CONSOLE: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 97, 255, 1));

const FORWARDING: &str = "/proc/sys/net/ipv4/ip_forward";

/// Namespaces, which end with it, as do workers in them.
pub(crate) struct Hosts {
    n: usize,
    /// What the machine did with packets that are for others.
    was_forwarding: String,
    workers: Vec<Child>,
}

impl Hosts {
    /// So many hosts, each with so many bytes a second either way; as many as there may be if zero.
    pub(crate) fn new(n: usize, bytes_per_sec: f64) -> Outcome<Self> {
        let was_forwarding = std::fs::read_to_string(FORWARDING)?;
        std::fs::write(FORWARDING, "1")?;
        let hosts = Self {
            n,
            was_forwarding,
            workers: Vec::new(),
        };
        ip(&format!("addr replace {CONSOLE}/32 dev lo"))?;
        for host in 0..n {
            let name = name(host);
            ip(&format!("netns add {name}"))?;
            ip(&format!(
                "link add {name} type veth peer name eth0 netns {name}"
            ))?;
            ip(&format!("addr add 10.97.{host}.1/24 dev {name}"))?;
            ip(&format!("link set {name} up"))?;
            ip(&format!("-n {name} addr add 10.97.{host}.2/24 dev eth0"))?;
            ip(&format!("-n {name} link set eth0 up"))?;
            ip(&format!("-n {name} link set lo up"))?;
            ip(&format!("-n {name} route add default via 10.97.{host}.1"))?;
            if bytes_per_sec > 0.0 {
                let rate = format!("rate {}bit burst 128kb latency 200ms", 8.0 * bytes_per_sec);
                run("tc", &format!("qdisc add dev {name} root tbf {rate}"))?;
                run(
                    "tc",
                    &format!("-n {name} qdisc add dev eth0 root tbf {rate}"),
                )?;
            }
        }
        Ok(hosts)
    }

    /// Starts a worker on a host, where it has a core of this machine to itself if there are enough:
    /// the first is left to the console.
    pub(crate) fn start(&mut self, host: usize, worker: &Path, ticket: &Ticket) -> Outcome<()> {
        let n_cores = std::thread::available_parallelism()?.get();
        let core = ((host + 1) % n_cores).to_string();
        let mut child = Command::new("ip")
            .args(["netns", "exec", &name(host), "taskset", "-c", &core])
            .arg(worker)
            .stdin(Stdio::piped())
            .spawn()?;
        let mut stdin = child
            .stdin
            .take()
            .ok_or("a worker without standard input")?;
        writeln!(stdin, "{}", serde_json::to_string(ticket)?)?;
        self.workers.push(child);
        Ok(())
    }

    /// Waits for workers, which end with their frame.
    pub(crate) fn wait(&mut self) -> Outcome<()> {
        for mut worker in self.workers.drain(..) {
            let status = worker.wait()?;
            if !status.success() {
                return Err(format!("a worker: {status}").into());
            }
        }
        Ok(())
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for worker in &mut self.workers {
            // It may have ended by itself.
            drop(worker.kill());
            drop(worker.wait());
        }
        for host in 0..self.n {
            // What was not made cannot be taken away. Links would end with their namespace, but later.
            drop(ip(&format!("link del {}", name(host))));
            drop(ip(&format!("netns del {}", name(host))));
        }
        drop(ip(&format!("addr del {CONSOLE}/32 dev lo")));
        drop(std::fs::write(FORWARDING, &self.was_forwarding));
    }
}

/// Of a host, its namespace, and this end of its link.
fn name(host: usize) -> String {
    format!("kilauea-{host}")
}

fn ip(words: &str) -> Outcome<()> {
    run("ip", words)
}

fn run(program: &str, words: &str) -> Outcome<()> {
    let output = Command::new(program).args(words.split(' ')).output()?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(format!("{program} {words}: {}", said.trim()).into())
}
