//! Who is at the other end: the token first, then whether both can render the same pixels.
//!
//! The console sends a [`Challenge`]; the worker answers with its [`Hello`] and the proof that it
//! knows the token; the console answers with its own, or with [`Refused`].

use std::io;
use std::time::Duration;

use tokio::time::timeout;

use crate::link::Link;
use crate::protocol::{Challenge, FrameError, FrameKind, Hello, Message, PROTOCOL, Refused};
use crate::ticket::{Ticket, Token};

/// Time for all of it, and before that for TLS.
pub(crate) const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(2);
/// Most bytes of a frame before the token has been proved.
const MAX_BODY_BYTES: u32 = 1 << 10;

/// Of the sources and the build settings: see `build.rs`.
const BUILD_HASH: &str = env!("KILAUEA_BUILD_HASH");

/// Why two processes do not go together.
#[derive(Debug, thiserror::Error)]
pub enum HandshakeError {
    /// No handshake came within two seconds.
    #[error("the handshake took longer than {} s", HANDSHAKE_TIMEOUT.as_secs())]
    Timeout,
    /// The bytes are no handshake.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// This side refuses the other.
    #[error("refused: {0}")]
    Refuses(String),
    /// The other side refuses this one.
    #[error("refused by the other side: {0}")]
    IsRefused(String),
}

impl From<io::Error> for HandshakeError {
    fn from(error: io::Error) -> Self {
        Self::Frame(error.into())
    }
}

/// Hash of the sources that this program was built from, and of how.
pub fn build_hash() -> u64 {
    u64::from_str_radix(BUILD_HASH, 16).expect("build.rs writes hexadecimal digits")
}

/// Who a console expects, by rank, incarnation and epoch; a reason in words where it does not.
pub(crate) type Admit<'a> = &'a mut (dyn FnMut(&Hello) -> Result<(), String> + Send);

/// The console's side. The worker has been admitted where this gives its [`Hello`].
pub(crate) async fn receive_worker(
    link: &mut Link,
    token: &Token,
    session: u64,
    scene_hash: [u8; 32],
    admit: Admit<'_>,
) -> Result<Hello, HandshakeError> {
    let ends = [Role::Console, Role::Worker];
    receive(link, ends, token, session, scene_hash, admit).await
}

/// The side of a worker that another one of its set wants to ask.
pub(crate) async fn receive_asker(
    link: &mut Link,
    ticket: &Ticket,
    scene_hash: [u8; 32],
    admit: Admit<'_>,
) -> Result<Hello, HandshakeError> {
    let ends = [Role::Owner, Role::Asker];
    receive(link, ends, &ticket.token, ticket.session, scene_hash, admit).await
}

async fn receive(
    link: &mut Link,
    [our_role, their_role]: [Role; 2],
    token: &Token,
    session: u64,
    scene_hash: [u8; 32],
    admit: Admit<'_>,
) -> Result<Hello, HandshakeError> {
    link.reader.limit_body(MAX_BODY_BYTES);
    let said = timeout(HANDSHAKE_TIMEOUT, async {
        let nonce = nonce()?;
        let challenge = Challenge { nonce };
        link.writer.write(&challenge.frame(0, &[])).await?;
        let frame = link.reader.read().await?;
        let (hello, _) = Hello::read(&frame)?;
        let checked = check(their_role, &hello, token, &nonce, session);
        let checked = checked.and_then(|()| admit(&hello));
        match checked {
            Ok(()) => {
                let answer = hello_of(
                    our_role,
                    token,
                    &hello.nonce,
                    &Hello {
                        scene_hash: Some(scene_hash),
                        nonce,
                        ..hello.clone()
                    },
                );
                link.writer.write(&answer.frame(hello.epoch, &[])).await?;
                Ok(hello)
            }
            Err(reason) => {
                let refused = Refused {
                    reason: reason.clone(),
                };
                link.writer.write(&refused.frame(0, &[])).await?;
                Err(HandshakeError::Refuses(reason))
            }
        }
    });
    let hello = said.await.map_err(|_| HandshakeError::Timeout)??;
    link.reader.expect_session(session);
    link.reader.limit_body(u32::MAX);
    Ok(hello)
}

/// The worker's side, which may have a scene of this hash; gives that of the scene that the console
/// has.
pub(crate) async fn join_console(
    link: &mut Link,
    ticket: &Ticket,
    held: Option<[u8; 32]>,
) -> Result<[u8; 32], HandshakeError> {
    join(link, [Role::Worker, Role::Console], ticket, held).await
}

/// The side of a worker that wants to ask another one of its set; gives the hash of the scene that the
/// other has.
pub(crate) async fn join_owner(
    link: &mut Link,
    ticket: &Ticket,
) -> Result<[u8; 32], HandshakeError> {
    join(link, [Role::Asker, Role::Owner], ticket, None).await
}

async fn join(
    link: &mut Link,
    [our_role, their_role]: [Role; 2],
    ticket: &Ticket,
    held: Option<[u8; 32]>,
) -> Result<[u8; 32], HandshakeError> {
    link.reader.limit_body(MAX_BODY_BYTES);
    let said = timeout(HANDSHAKE_TIMEOUT, async {
        let (challenge, _) = Challenge::read(&link.reader.read().await?)?;
        let ours = hello_of(
            our_role,
            &ticket.token,
            &challenge.nonce,
            &Hello {
                protocols: [PROTOCOL, PROTOCOL],
                build_hash: build_hash(),
                is_little_endian: cfg!(target_endian = "little"),
                scene_hash: held,
                session: ticket.session,
                rank: ticket.rank,
                incarnation: ticket.incarnation,
                epoch: ticket.epoch,
                nonce: nonce()?,
                proof: [0; 32],
            },
        );
        link.writer.write(&ours.frame(ticket.epoch, &[])).await?;
        let frame = link.reader.read().await?;
        if frame.kind == FrameKind::Refused {
            let (Refused { reason }, _) = Refused::read(&frame)?;
            return Err(HandshakeError::IsRefused(reason));
        }
        let (theirs, _) = Hello::read(&frame)?;
        if !is_proved(their_role, &theirs, &ticket.token, &ours.nonce) {
            let reason = "it does not know the token".into();
            return Err(HandshakeError::Refuses(reason));
        }
        let no_scene = || HandshakeError::Refuses("it has no scene".into());
        theirs.scene_hash.ok_or_else(no_scene)
    });
    let scene_hash = said.await.map_err(|_| HandshakeError::Timeout)??;
    link.reader.expect_session(ticket.session);
    link.reader.limit_body(u32::MAX);
    Ok(scene_hash)
}

/// Who proves something. It is part of the proof, so that nobody can send it back as their own.
#[derive(Clone, Copy)]
enum Role {
    Console,
    Worker,
    /// A worker that answers others of its set.
    Owner,
    /// A worker that asks others of its set.
    Asker,
}

impl Role {
    fn name(self) -> &'static [u8] {
        match self {
            Self::Console => b"kilauea console",
            Self::Worker => b"kilauea worker",
            Self::Owner => b"kilauea owner",
            Self::Asker => b"kilauea asker",
        }
    }
}

/// The token before anything else, then what must be equal on both sides.
fn check(
    their_role: Role,
    hello: &Hello,
    token: &Token,
    our_nonce: &[u8; 32],
    session: u64,
) -> Result<(), String> {
    let [first, last] = hello.protocols;
    if !is_proved(their_role, hello, token, our_nonce) {
        return Err("the token is not that of this session".into());
    }
    if !(first..=last).contains(&PROTOCOL) {
        return Err(format!("protocols {first} to {last}, not {PROTOCOL}"));
    }
    if hello.build_hash != build_hash() {
        return Err(format!(
            "build {:016x}, not {BUILD_HASH}: pixels are only equal between equal builds",
            hello.build_hash
        ));
    }
    if hello.is_little_endian != cfg!(target_endian = "little") {
        return Err("another order of bytes".into());
    }
    if hello.session != session {
        return Err(format!("session {:016x} is not this one", hello.session));
    }
    Ok(())
}

/// A hello with its proof, for one who sent that nonce.
fn hello_of(role: Role, token: &Token, their_nonce: &[u8; 32], hello: &Hello) -> Hello {
    Hello {
        proof: *proof(role, hello, token, their_nonce).as_bytes(),
        ..hello.clone()
    }
}

/// Whether a hello proves that its sender knows the token. Takes the same time whatever differs.
fn is_proved(role: Role, hello: &Hello, token: &Token, our_nonce: &[u8; 32]) -> bool {
    proof(role, hello, token, our_nonce) == blake3::Hash::from_bytes(hello.proof)
}

fn proof(role: Role, hello: &Hello, token: &Token, nonce: &[u8; 32]) -> blake3::Hash {
    let unproved = Hello {
        proof: [0; 32],
        ..hello.clone()
    };
    token.prove(&[role.name(), nonce, &unproved.frame(0, &[]).body])
}

fn nonce() -> Result<[u8; 32], io::Error> {
    let mut nonce = [0; 32];
    getrandom::fill(&mut nonce).map_err(io::Error::other)?;
    Ok(nonce)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Traffic, channel};
    use crate::protocol::Frame;
    use std::sync::Arc;
    use tokio::io::AsyncWriteExt;

    const SESSION: u64 = 7;
    const SCENE_HASH: [u8; 32] = [3; 32];

    fn token(byte: char) -> Token {
        Token::try_from(byte.to_string().repeat(64)).unwrap()
    }

    fn ticket() -> Ticket {
        Ticket {
            address: String::new(),
            session: SESSION,
            token: token('a'),
            rank: 2,
            incarnation: 1,
            epoch: 5,
            identity: None,
        }
    }

    /// A console that expects the worker of [`ticket`].
    async fn console(mut link: Link) -> Result<Hello, HandshakeError> {
        let mut admit = |hello: &Hello| match hello.rank {
            2 => Ok(()),
            rank => Err(format!("worker {rank} is not expected")),
        };
        receive_worker(&mut link, &token('a'), SESSION, SCENE_HASH, &mut admit).await
    }

    fn links() -> (Link, Link) {
        let (a, b) = channel();
        let link = |end| Link::over_channel(end, SESSION, Arc::new(Traffic::default()));
        (link(a), link(b))
    }

    #[tokio::test]
    async fn those_who_know_the_token_join() {
        let (ours, mut theirs) = links();
        let ticket = ticket();
        let (said, joined) = tokio::join!(console(ours), join_console(&mut theirs, &ticket, None));
        let hello = said.unwrap();
        assert_eq!((hello.rank, hello.incarnation, hello.epoch), (2, 1, 5));
        assert_eq!(joined.unwrap(), SCENE_HASH);
    }

    /// What both sides say where the worker's ticket is another.
    async fn refusal(change: fn(&mut Ticket)) -> [String; 2] {
        let (ours, mut theirs) = links();
        let mut ticket = ticket();
        change(&mut ticket);
        let (said, joined) = tokio::join!(console(ours), join_console(&mut theirs, &ticket, None));
        [
            said.unwrap_err().to_string(),
            joined.unwrap_err().to_string(),
        ]
    }

    #[tokio::test]
    async fn others_are_told_why_they_may_not() {
        type Change = fn(&mut Ticket);
        let cases: [(Change, &str); 3] = [
            (|t| t.token = token('b'), "token"),
            (|t| t.session = 8, "session"),
            (|t| t.rank = 3, "not expected"),
        ];
        for (change, word) in cases {
            for reason in refusal(change).await {
                assert!(
                    reason.contains("refused") && reason.contains(word),
                    "{reason}"
                );
            }
        }
    }

    /// What the console says to a worker that knows the token and whose hello is another.
    async fn answer_to(change: fn(&mut Hello)) -> String {
        let (ours, mut theirs) = links();
        let worker = async {
            let challenge = theirs.reader.read().await.unwrap();
            let (challenge, _) = Challenge::read(&challenge).unwrap();
            let mut hello = Hello {
                protocols: [PROTOCOL, PROTOCOL],
                build_hash: build_hash(),
                is_little_endian: true,
                scene_hash: None,
                session: SESSION,
                rank: 2,
                incarnation: 1,
                epoch: 5,
                nonce: [1; 32],
                proof: [0; 32],
            };
            change(&mut hello);
            let hello = hello_of(Role::Worker, &token('a'), &challenge.nonce, &hello);
            theirs.writer.write(&hello.frame(0, &[])).await.unwrap();
            let answer = theirs.reader.read().await.unwrap();
            Refused::read(&answer).map_or_else(|e| e.to_string(), |(refused, _)| refused.reason)
        };
        tokio::join!(console(ours), worker).1
    }

    #[tokio::test]
    async fn only_equal_builds_go_together() {
        assert!(answer_to(|h| h.build_hash ^= 1).await.contains("build"));
        assert!(
            answer_to(|h| h.is_little_endian = false)
                .await
                .contains("bytes")
        );
        assert!(
            answer_to(|h| h.protocols = [2, 9])
                .await
                .contains("protocols 2 to 9")
        );
        assert!(answer_to(|h| h.session = 0).await.contains("session"));
    }

    #[tokio::test]
    async fn a_console_without_the_token_gets_no_worker() {
        let (mut ours, mut theirs) = links();
        let ticket = ticket();
        let console = async {
            let nonce = [0; 32];
            ours.writer
                .write(&Challenge { nonce }.frame(0, &[]))
                .await
                .unwrap();
            let (hello, _) = Hello::read(&ours.reader.read().await.unwrap()).unwrap();
            // What the worker said, sent back to it.
            ours.writer.write(&hello.frame(0, &[])).await.unwrap();
        };
        let (joined, ()) = tokio::join!(join_console(&mut theirs, &ticket, None), console);
        assert!(joined.unwrap_err().to_string().contains("token"));
    }

    #[tokio::test(start_paused = true)]
    async fn those_who_say_nothing_are_left() {
        let (ours, _theirs) = links();
        assert!(matches!(console(ours).await, Err(HandshakeError::Timeout)));
        let (_ours, mut theirs) = links();
        let joined = join_console(&mut theirs, &ticket(), None).await;
        assert!(matches!(joined, Err(HandshakeError::Timeout)));
    }

    #[tokio::test]
    async fn other_programs_are_left_at_once() {
        let long = Frame::new(FrameKind::SceneBytes, 0, vec![0; 2000]);
        let long = [&long.header(SESSION, 0).unwrap()[..], &long.body].concat();
        for bytes in [
            &b"GET / HTTP/1.1\r\nHost: kilauea.example\r\n\r\n"[..],
            b"KIL",
            &long,
        ] {
            let (a, mut b) = channel();
            b.write_all(bytes).await.unwrap();
            b.shutdown().await.unwrap();
            let link = Link::over_channel(a, SESSION, Arc::new(Traffic::default()));
            let error = console(link).await.unwrap_err();
            assert!(matches!(error, HandshakeError::Frame(_)), "{error}");
        }
    }
}
