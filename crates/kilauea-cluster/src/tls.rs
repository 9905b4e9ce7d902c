//! TLS between machines: certificates that a console makes for one session and that nothing else
//! trusts.
//!
//! Both sides show one. A worker gets its own with its ticket, so whoever has no ticket ends in the
//! TLS handshake, before a byte of it is looked at.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use rcgen::{
    BasicConstraints, CertificateParams, CertifiedIssuer, ExtendedKeyUsagePurpose, IsCa, KeyPair,
    KeyUsagePurpose,
};
use serde::{Deserialize, Serialize};
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivatePkcs8KeyDer, ServerName};
use tokio_rustls::rustls::server::WebPkiClientVerifier;
use tokio_rustls::rustls::version::TLS13;
use tokio_rustls::rustls::{ClientConfig, RootCertStore, ServerConfig};
use tokio_rustls::{TlsAcceptor, TlsConnector};

/// Whom a worker expects at the other end.
const CONSOLE: &str = "console.kilauea";
const WORKER: &str = "worker.kilauea";
/// Clocks of machines may differ by this.
const CLOCK_SKEW: Duration = Duration::from_hours(24);
/// No session lasts longer.
const VALIDITY: Duration = Duration::from_hours(24 * 90);

/// Signs the certificates of a session. Its key stays in the console's memory.
pub(crate) struct Authority(CertifiedIssuer<'static, KeyPair>);

/// What one side shows and by what it judges the other.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    authority: Vec<u8>,
    certificate: Vec<u8>,
    key: Vec<u8>,
}

impl Authority {
    /// One that nobody knows yet.
    pub(crate) fn new() -> io::Result<Self> {
        let mut params = params(&[])?;
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let key = KeyPair::generate().map_err(io::Error::other)?;
        let issuer = CertifiedIssuer::self_signed(params, key).map_err(io::Error::other)?;
        Ok(Self(issuer))
    }

    /// The console's own.
    pub(crate) fn console(&self) -> io::Result<Identity> {
        self.issue(CONSOLE, &[ExtendedKeyUsagePurpose::ServerAuth])
    }

    /// A worker's, who may be asked by other workers.
    pub(crate) fn worker(&self) -> io::Result<Identity> {
        let usages = [
            ExtendedKeyUsagePurpose::ClientAuth,
            ExtendedKeyUsagePurpose::ServerAuth,
        ];
        self.issue(WORKER, &usages)
    }

    fn issue(&self, name: &str, usages: &[ExtendedKeyUsagePurpose]) -> io::Result<Identity> {
        let mut params = params(&[name.to_owned()])?;
        params.extended_key_usages = usages.to_vec();
        let key = KeyPair::generate().map_err(io::Error::other)?;
        let certificate = params.signed_by(&key, &self.0).map_err(io::Error::other)?;
        Ok(Identity {
            authority: self.0.der().to_vec(),
            certificate: certificate.der().to_vec(),
            key: key.serialize_der(),
        })
    }
}

fn params(names: &[String]) -> io::Result<CertificateParams> {
    let mut params = CertificateParams::new(names).map_err(io::Error::other)?;
    let now = SystemTime::now();
    params.not_before = (now - CLOCK_SKEW).into();
    params.not_after = (now + VALIDITY).into();
    Ok(params)
}

impl Identity {
    /// The side that is connected to, a console or a worker: lets in whoever shows a certificate of the session.
    pub(crate) fn acceptor(&self) -> io::Result<TlsAcceptor> {
        let provider = provider();
        let verifier = WebPkiClientVerifier::builder_with_provider(
            Arc::new(self.roots()?),
            Arc::clone(&provider),
        )
        .build()
        .map_err(io::Error::other)?;
        let (chain, key) = self.shown();
        let config = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&TLS13])
            .and_then(|builder| {
                builder
                    .with_client_cert_verifier(verifier)
                    .with_single_cert(chain, key.into())
            })
            .map_err(io::Error::other)?;
        Ok(Arc::new(config).into())
    }

    /// The worker's side, and the name to ask for.
    pub(crate) fn connector(&self) -> io::Result<(TlsConnector, ServerName<'static>)> {
        self.connector_to(CONSOLE)
    }

    /// The same to another worker.
    pub(crate) fn connector_to_worker(&self) -> io::Result<(TlsConnector, ServerName<'static>)> {
        self.connector_to(WORKER)
    }

    fn connector_to(&self, name: &'static str) -> io::Result<(TlsConnector, ServerName<'static>)> {
        let (chain, key) = self.shown();
        let roots = self.roots()?;
        let config = ClientConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .and_then(|builder| {
                builder
                    .with_root_certificates(roots)
                    .with_client_auth_cert(chain, key.into())
            })
            .map_err(io::Error::other)?;
        let name = ServerName::try_from(name).map_err(io::Error::other)?;
        Ok((Arc::new(config).into(), name))
    }

    fn roots(&self) -> io::Result<RootCertStore> {
        let mut roots = RootCertStore::empty();
        let authority = CertificateDer::from(self.authority.clone());
        roots.add(authority).map_err(io::Error::other)?;
        Ok(roots)
    }

    fn shown(&self) -> (Vec<CertificateDer<'static>>, PrivatePkcs8KeyDer<'static>) {
        let certificate = CertificateDer::from(self.certificate.clone());
        (vec![certificate], self.key.clone().into())
    }
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

impl fmt::Debug for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Identity(secret)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    /// What the console reads of a worker that sends a few bytes.
    async fn converse(console: &Identity, worker: &Identity) -> io::Result<[u8; 5]> {
        let (ours, theirs) = tokio::io::duplex(1 << 16);
        let acceptor = console.acceptor()?;
        let (connector, name) = worker.connector()?;
        let accepted = async {
            let mut stream = acceptor.accept(ours).await?;
            let mut bytes = [0; 5];
            stream.read_exact(&mut bytes).await?;
            // Not dropped before the other side has ended.
            io::Result::Ok((bytes, stream))
        };
        let sent = async {
            let mut stream = connector.connect(name, theirs).await?;
            stream.write_all(b"units").await?;
            stream.flush().await?;
            io::Result::Ok(stream)
        };
        let (accepted, sent) = tokio::join!(accepted, sent);
        let (sent, (bytes, accepted)) = (sent?, accepted?);
        drop((sent, accepted));
        Ok(bytes)
    }

    #[tokio::test]
    async fn those_of_a_session_talk() {
        let session = Authority::new().expect("an authority");
        let (console, worker) = (session.console().unwrap(), session.worker().unwrap());
        assert_eq!(converse(&console, &worker).await.unwrap(), *b"units");
        let line = serde_json::to_string(&worker).unwrap();
        let worker: Identity = serde_json::from_str(&line).unwrap();
        assert_eq!(converse(&console, &worker).await.unwrap(), *b"units");
    }

    #[tokio::test]
    async fn strangers_end_in_the_handshake() {
        let [ours, others] = [(); 2].map(|()| Authority::new().expect("an authority"));
        let (console, worker) = (ours.console().unwrap(), ours.worker().unwrap());
        // A worker of another session, and a console that is none.
        assert!(converse(&console, &others.worker().unwrap()).await.is_err());
        assert!(converse(&others.console().unwrap(), &worker).await.is_err());
        // One that trusts us and whom we do not know.
        let stranger = Identity {
            authority: worker.authority.clone(),
            ..others.worker().unwrap()
        };
        assert!(converse(&console, &stranger).await.is_err());
        // A worker that would be a console.
        assert!(converse(&worker, &worker).await.is_err());
    }

    #[tokio::test]
    async fn a_certificate_ends_with_its_time() {
        let session = Authority::new().expect("an authority");
        let mut params = params(&[WORKER.to_owned()]).unwrap();
        params.not_before = (SystemTime::now() - 2 * CLOCK_SKEW).into();
        params.not_after = (SystemTime::now() - CLOCK_SKEW).into();
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        let key = KeyPair::generate().unwrap();
        let certificate = params.signed_by(&key, &session.0).unwrap();
        let late = Identity {
            certificate: certificate.der().to_vec(),
            key: key.serialize_der(),
            ..session.worker().unwrap()
        };
        assert!(converse(&session.console().unwrap(), &late).await.is_err());
    }
}
