//! What lets a worker join: where to, and the secret that it must know.

use std::fmt;
use std::io;

use serde::{Deserialize, Serialize};

use crate::tls::Identity;

/// A secret of 32 random bytes that all processes of a session know.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Token([u8; 32]);

/// Where a worker is to join, and as whom. One line of JSON, which goes to the worker's standard
/// input: command lines and environments can be read by others.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ticket {
    /// Host and port of the console.
    pub address: String,
    /// The session.
    pub session: u64,
    /// The secret.
    pub token: Token,
    /// Number of the worker.
    pub rank: u32,
    /// How often it was started before.
    pub incarnation: u32,
    /// The life that it begins.
    pub epoch: u32,
    /// What it shows in the TLS handshake; no TLS without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<Identity>,
}

impl Token {
    /// A new secret.
    pub fn random() -> io::Result<Self> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        Ok(Self(bytes))
    }

    /// Proof that one knows the secret: a keyed hash of what was said.
    pub(crate) fn prove(&self, said: &[&[u8]]) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new_keyed(&self.0);
        for part in said {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        hasher.finalize()
    }
}

/// A random number.
pub(crate) fn random_u64() -> io::Result<u64> {
    getrandom::u64().map_err(io::Error::other)
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(secret)")
    }
}

impl From<Token> for String {
    fn from(token: Token) -> Self {
        blake3::Hash::from_bytes(token.0).to_hex().to_string()
    }
}

impl TryFrom<String> for Token {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let bytes = blake3::Hash::from_hex(text).map_err(|_| "a token is 64 hexadecimal digits")?;
        Ok(Self(*bytes.as_bytes()))
    }
}
