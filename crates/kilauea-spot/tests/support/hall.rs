//! A hall of mirrors, without light: every node asks what it sees, then spawns the node behind the
//! mirror and some that lead nowhere.

use kilauea_spot::{Answerer, Context, Pool, Program, Runtime, Wire, WireError};

/// Sums of three channels. Their rounding shows any change of order.
pub(crate) type Sum = [f32; 3];

/// The hall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hall {
    /// Nodes from a root to the end of its chain.
    pub(crate) depth: u32,
    /// Children of each node, of which one goes on.
    pub(crate) fan_out: u32,
    /// Square roots that a mirror computes.
    pub(crate) n_terms: u32,
}

/// A SPOT of the hall.
pub(crate) enum Node {
    /// A root.
    Entrance(u64),
    /// A node with so many below it.
    Mirror { key: u64, n_below: u32 },
    /// The end of a chain.
    Wall(u64),
}

/// As large as a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Question {
    pub(crate) key: u64,
    pub(crate) ray: [f32; 7],
}

/// As large as a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    pub(crate) t: f32,
    pub(crate) weights: [f32; 2],
    pub(crate) id: u32,
}

impl Question {
    pub(crate) fn new(key: u64) -> Self {
        Self {
            key,
            ray: [unit(key); 7],
        }
    }
}

impl Program for Hall {
    type Work = Node;
    type Output = Sum;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Node, R::Context) -> R::Started {
        let (entrances, mirrors) = (runtime.pool("entrance"), runtime.pool("mirror"));
        let walls = runtime.pool("wall");
        move |node, cx| match node {
            Node::Entrance(key) => entrances.start(self.enter(key, cx)),
            Node::Mirror { key, n_below } => mirrors.start(self.reflect(key, n_below, cx)),
            Node::Wall(key) => walls.start(wall(key, cx)),
        }
    }
}

impl Hall {
    async fn enter<C: Context<Self>>(&self, key: u64, cx: C) -> Sum {
        let hit = cx.ask(Question::new(key)).await;
        let n_below = self.depth;
        let seen = cx.spawn(Node::Mirror { key, n_below }).await;
        scaled(seen, hit.t)
    }

    async fn reflect<C: Context<Self>>(&self, key: u64, n_below: u32, cx: C) -> Sum {
        let hit = cx.ask(Question::new(key)).await;
        let shadow = cx.ask(Question::new(mix(key ^ 1)));
        // Asked, and found to be of no interest: its slot is free before the answer comes.
        drop(cx.ask(Question::new(mix(key ^ 2))));

        let key = mix(key ^ u64::from(hit.id));
        let behind = if n_below > 0 {
            cx.spawn(Node::Mirror {
                key,
                n_below: n_below - 1,
            })
        } else {
            cx.spawn(Node::Wall(key))
        };
        let mut dead_ends = [const { None }; 8];
        let n_dead_ends = (self.fan_out as usize - 1).min(dead_ends.len());
        for (i, dead_end) in dead_ends[..n_dead_ends].iter_mut().enumerate() {
            *dead_end = Some(cx.spawn(Node::Wall(mix(key ^ i as u64))));
        }
        let mut sum = scaled(behind.await, 0.9);
        for dead_end in dead_ends.into_iter().flatten() {
            add(&mut sum, dead_end.await);
        }
        let shine = busy_work(key, self.n_terms);
        scaled(sum, shadow.await.t * shine)
    }
}

async fn wall<C: Context<Hall>>(key: u64, cx: C) -> Sum {
    let first = cx.ask(Question::new(key));
    let second = cx.ask(Question::new(mix(key)));
    let [u, v] = first.await.weights;
    [u, v, second.await.t]
}

/// Answers with numbers that depend on the question alone.
pub(crate) struct Geometry;

impl<P: Program<Question = Question, Answer = Answer>> Answerer<P> for Geometry {
    fn answer(&self, question: Question) -> Answer {
        let key = mix(question.key);
        Answer {
            t: 0.5 + 0.5 * unit(key),
            weights: [unit(mix(key)), question.ray[3]],
            id: (key >> 40) as u32,
        }
    }
}

impl Wire for Question {
    fn encode(&self, bytes: &mut Vec<u8>) {
        self.key.encode(bytes);
        self.ray.encode(bytes);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            key: u64::decode(bytes)?,
            ray: Wire::decode(bytes)?,
        })
    }
}

impl Wire for Answer {
    fn encode(&self, bytes: &mut Vec<u8>) {
        self.t.encode(bytes);
        self.weights.encode(bytes);
        self.id.encode(bytes);
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            t: f32::decode(bytes)?,
            weights: Wire::decode(bytes)?,
            id: u32::decode(bytes)?,
        })
    }
}

/// Mixes the bits of a number (Steele, Lea & Flood 2014, SplitMix64).
pub(crate) fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1).
pub(crate) fn unit(key: u64) -> f32 {
    (key >> 40) as f32 / (1 << 24) as f32
}

/// Takes time as the computations between questions do; in (0, 1).
#[inline(never)]
pub(crate) fn busy_work(key: u64, n_terms: u32) -> f32 {
    let mut x = unit(mix(key));
    for _ in 0..n_terms {
        x = (1.0 - 0.9 * x * x).sqrt();
    }
    x
}

fn add(sum: &mut Sum, other: Sum) {
    for (s, o) in sum.iter_mut().zip(other) {
        *s += o;
    }
}

fn scaled(sum: Sum, factor: f32) -> Sum {
    sum.map(|s| s * factor)
}
