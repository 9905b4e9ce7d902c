//! What a machine and its messages are like.

/// A machine of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// Rays that it traces in a second, over what it holds, with all its cores.
    pub rays_per_sec: f64,
    /// Bytes that its network card sends in a second, and as many that it receives.
    pub nic_bytes_per_sec: f64,
    /// Seconds of its own that each ray costs whoever asks it: shading, and whom to ask.
    pub shade_secs: f64,
    /// Seconds that each message costs who sends it, and who receives it.
    pub message_secs: f64,
    /// Seconds that each ray that another is asked costs beside tracing it: half of them who asks, half
    /// who answers.
    pub question_secs: f64,
}

/// Bytes of messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySizes {
    /// Of a ray to a member.
    pub ray: f64,
    /// Of a hit that comes back; what is not hit is not sent.
    pub hit: f64,
    /// Of each batch, and of each reply.
    pub frame: f64,
}

/// How rays travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batching {
    /// Rays that travel together, at most.
    pub rays: usize,
    /// Seconds after which a batch leaves, however full.
    pub seal_secs: f64,
    /// Seconds there and back of the smallest message.
    pub rtt_secs: f64,
    /// Rays that a machine has under way at most.
    pub pool: usize,
}

impl Machine {
    /// One that traces so many million rays a second on a network of so many gigabits.
    pub fn new(mrays_per_sec: f64, gigabits: f64) -> Self {
        Self {
            rays_per_sec: 1e6 * mrays_per_sec,
            nic_bytes_per_sec: 1e9 / 8.0 * gigabits,
            shade_secs: 0.0,
            message_secs: 0.0,
            question_secs: 0.0,
        }
    }
}

impl Default for RaySizes {
    /// As measured on the wire without packing, rounded up.
    fn default() -> Self {
        Self {
            ray: 28.0,
            hit: 64.0,
            frame: 64.0,
        }
    }
}

impl Default for Batching {
    fn default() -> Self {
        Self {
            rays: 1024,
            seal_secs: 0.5e-3,
            rtt_secs: 0.2e-3,
            pool: 1 << 16,
        }
    }
}
