//! Closed forms: what a set could do if no machine ever waited for another.
//!
//! With `m` machines in a set, `k` of them asked for each ray, `h` of those answering with a hit, and
//! owners by chance, a machine sends `(1 - 1/m) (k b_r + h b_h)` bytes for each ray that it asks:
//! rays of its own to others, and hits to others of their rays.

use crate::machine::{Machine, RaySizes};

/// How a scene asks a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asking {
    /// Machines in the set.
    pub n_members: usize,
    /// Machines asked for a ray, on average, whoever asks among them or not.
    pub asked: f64,
    /// Of those, machines that answer with a hit.
    pub met: f64,
    /// Rays asked of the busiest machine, over the mean.
    pub imbalance: f64,
}

/// Bytes that a machine sends, and receives, for each ray that it asks.
pub fn bytes_per_ray(asking: &Asking, sizes: &RaySizes) -> f64 {
    let elsewhere = 1.0 - 1.0 / asking.n_members as f64;
    elsewhere * (asking.asked * sizes.ray + asking.met * sizes.hit)
}

/// Rays that each machine of a set of equal ones gets answered in a second.
pub fn rays_per_machine(machine: &Machine, asking: &Asking, sizes: &RaySizes) -> f64 {
    let by_network = machine.nic_bytes_per_sec / bytes_per_ray(asking, sizes);
    let busiest = asking.imbalance * asking.asked / machine.rays_per_sec;
    let by_processor = 1.0 / (busiest + machine.shade_secs);
    by_processor.min(by_network)
}

/// Bytes a second of a network card that keeps machines busy: about that of the rays that they
/// trace, whatever the size of the set.
pub fn saturating_nic(machine: &Machine, asking: &Asking, sizes: &RaySizes) -> f64 {
    let busiest = asking.imbalance * asking.asked / machine.rays_per_sec;
    bytes_per_ray(asking, sizes) / (busiest + machine.shade_secs)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: RaySizes = RaySizes {
        ray: 32.0,
        hit: 20.0,
        frame: 0.0,
    };

    fn asking(n_members: usize, asked: f64) -> Asking {
        Asking {
            n_members,
            asked,
            met: 0.0,
            imbalance: 1.0,
        }
    }

    #[test]
    fn a_set_of_one_sends_nothing() {
        let machine = Machine::new(20.0, 1.0);
        assert_eq!(bytes_per_ray(&asking(1, 1.0), &SIZES), 0.0);
        assert_eq!(rays_per_machine(&machine, &asking(1, 1.0), &SIZES), 20e6);
    }

    #[test]
    fn full_broadcast_gives_memory_and_no_speed() {
        let machine = Machine::new(20.0, 1e6);
        for m in [2, 10, 50] {
            let rate = rays_per_machine(&machine, &asking(m, m as f64), &SIZES);
            assert!((rate * m as f64 - 20e6).abs() < 1.0, "{rate}");
        }
    }

    #[test]
    fn what_network_a_machine_needs_hardly_depends_on_the_set() {
        let machine = Machine::new(20.0, 1.0);
        let needed = |m, k| saturating_nic(&machine, &asking(m, k), &SIZES);
        let (small, large) = (needed(8, 3.3), needed(128, 5.6));
        assert!((small / large - 1.0).abs() < 0.13, "{small} {large}");
        // 20 million rays of 32 bytes: 5 Gb/s.
        assert!((large * 8.0 / 1e9 - 5.1).abs() < 0.1, "{large}");
    }
}
