//! A link between two processes: frames one way and the other, over anything that carries bytes.
//!
//! Over TCP between processes, over a channel of bytes within one. Both ends see the same frames.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream};
use tokio::net::TcpStream;
use tokio_rustls::TlsStream;

use crate::protocol::{Expected, Frame, FrameError, HEADER_BYTES, Header};

/// Bytes that a channel within a process holds until the other side reads them; the writer waits
/// where it is full, and readers never wait for writers.
const CHANNEL_BYTES: usize = 1 << 20;

/// Bytes that come.
pub type ByteReader = Box<dyn AsyncRead + Send + Unpin>;
/// Bytes that go.
pub type ByteWriter = Box<dyn AsyncWrite + Send + Unpin>;

/// What one end of a link sends and gets.
pub struct Link {
    /// Frames that come.
    pub reader: FrameReader,
    /// Frames that go.
    pub writer: FrameWriter,
}

/// What went over links; shared by those of one frame.
#[derive(Debug, Default)]
pub struct Traffic {
    /// Bytes that went, headers included.
    pub bytes_sent: AtomicU64,
    /// Bytes that came.
    pub bytes_received: AtomicU64,
    /// Frames either way.
    pub messages: AtomicU64,
    /// Of those, frames of an earlier life that nobody hears.
    pub stale_messages: AtomicU64,
}

impl Link {
    /// Over any two streams of bytes.
    pub fn new(
        reader: ByteReader,
        writer: ByteWriter,
        session: u64,
        traffic: Arc<Traffic>,
    ) -> Self {
        Self {
            reader: FrameReader {
                bytes: reader,
                session: None,
                max_body_bytes: u32::MAX,
                number: 0,
                traffic: Arc::clone(&traffic),
            },
            writer: FrameWriter {
                bytes: writer,
                session,
                number: 0,
                traffic,
            },
        }
    }

    /// Over a connection. Frames are sent at once.
    pub fn over_tcp(stream: TcpStream, session: u64, traffic: Arc<Traffic>) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        let (reader, writer) = stream.into_split();
        Ok(Self::new(
            Box::new(reader),
            Box::new(writer),
            session,
            traffic,
        ))
    }

    /// Over one end of a channel within this process.
    pub fn over_channel(end: DuplexStream, session: u64, traffic: Arc<Traffic>) -> Self {
        Self::over(end, session, traffic)
    }

    /// Over a connection that others cannot read.
    pub(crate) fn over_tls(
        stream: impl Into<TlsStream<TcpStream>>,
        session: u64,
        traffic: Arc<Traffic>,
    ) -> io::Result<Self> {
        let stream = stream.into();
        stream.get_ref().0.set_nodelay(true)?;
        Ok(Self::over(stream, session, traffic))
    }

    fn over(
        stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static,
        session: u64,
        traffic: Arc<Traffic>,
    ) -> Self {
        let (reader, writer) = tokio::io::split(stream);
        Self::new(Box::new(reader), Box::new(writer), session, traffic)
    }
}

/// The two ends of a channel of bytes.
pub fn channel() -> (DuplexStream, DuplexStream) {
    tokio::io::duplex(CHANNEL_BYTES)
}

/// Reads frames.
pub struct FrameReader {
    bytes: ByteReader,
    session: Option<u64>,
    max_body_bytes: u32,
    number: u16,
    traffic: Arc<Traffic>,
}

impl FrameReader {
    /// From now on frames must be of that session.
    pub fn expect_session(&mut self, session: u64) {
        self.session = Some(session);
    }

    /// From now on no frame may be longer than this, nor than its kind allows.
    pub fn limit_body(&mut self, max_body_bytes: u32) {
        self.max_body_bytes = max_body_bytes;
    }

    /// Waits for the next frame. After an error nothing more can be read.
    pub async fn read(&mut self) -> Result<Frame, FrameError> {
        let mut header = [0; HEADER_BYTES];
        let mut n_read = 0;
        while n_read < HEADER_BYTES {
            match self.bytes.read(&mut header[n_read..]).await {
                Ok(0) if n_read == 0 => return Err(FrameError::Closed),
                Ok(0) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
                Ok(n) => n_read += n,
                // Over TLS, a process that ended without a farewell.
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof && n_read == 0 => {
                    return Err(FrameError::Closed);
                }
                Err(error) => return Err(error.into()),
            }
        }
        let expected = Expected {
            session: self.session,
            number: self.number,
            max_body_bytes: self.max_body_bytes,
        };
        let header = Header::parse(&header, &expected)?;
        let mut body = vec![0; header.n_body_bytes()];
        self.bytes.read_exact(&mut body).await?;
        self.number = self.number.wrapping_add(1);
        let n_bytes = (HEADER_BYTES + body.len()) as u64;
        self.traffic
            .bytes_received
            .fetch_add(n_bytes, Ordering::Relaxed);
        self.traffic.messages.fetch_add(1, Ordering::Relaxed);
        header.with_body(body)
    }
}

/// Writes frames.
pub struct FrameWriter {
    bytes: ByteWriter,
    session: u64,
    number: u16,
    traffic: Arc<Traffic>,
}

impl FrameWriter {
    /// Sends a frame. Waits while the other side does not read.
    pub async fn write(&mut self, frame: &Frame) -> Result<(), FrameError> {
        let header = frame.header(self.session, self.number)?;
        self.number = self.number.wrapping_add(1);
        self.bytes.write_all(&header).await?;
        self.bytes.write_all(&frame.body).await?;
        self.bytes.flush().await?;
        let n_bytes = (HEADER_BYTES + frame.body.len()) as u64;
        self.traffic
            .bytes_sent
            .fetch_add(n_bytes, Ordering::Relaxed);
        self.traffic.messages.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}
