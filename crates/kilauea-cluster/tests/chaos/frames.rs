//! Frames instead of bytes, so that some may be left out, repeated or put in another order and still
//! be frames: numbers and checksums are made anew.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};

use kilauea_cluster::protocol::{Expected, Frame, HEADER_BYTES, Header};

use super::Rewrite;

/// Carries what `rewrite` makes of each frame until one end is closed.
pub(super) fn rewrite(mut from: TcpStream, mut to: TcpStream, mut rewrite: Rewrite) {
    let mut n_out = 0_u16;
    for number in 0..=u16::MAX {
        let Ok((session, frame)) = read(&mut from, number) else {
            break;
        };
        let mut sent = Ok(());
        for frame in rewrite(frame) {
            sent = sent.and_then(|()| write(&mut to, session, n_out, &frame));
            n_out = n_out.wrapping_add(1);
        }
        if sent.is_err() {
            break;
        }
    }
    // What one end has closed is closed at the other.
    let _ = (to.shutdown(Shutdown::Both), from.shutdown(Shutdown::Both));
}

fn read(from: &mut TcpStream, number: u16) -> io::Result<(u64, Frame)> {
    let mut bytes = [0; HEADER_BYTES];
    from.read_exact(&mut bytes)?;
    let expected = Expected {
        session: None,
        number,
        max_body_bytes: u32::MAX,
    };
    let header = Header::parse(&bytes, &expected).map_err(io::Error::other)?;
    let mut body = vec![0; header.n_body_bytes()];
    from.read_exact(&mut body)?;
    let session = [16, 17, 18, 19, 20, 21, 22, 23].map(|i| bytes[i]);
    let frame = header.with_body(body).map_err(io::Error::other)?;
    Ok((u64::from_le_bytes(session), frame))
}

fn write(to: &mut TcpStream, session: u64, number: u16, frame: &Frame) -> io::Result<()> {
    let header = frame.header(session, number).map_err(io::Error::other)?;
    to.write_all(&header)?;
    to.write_all(&frame.body)
}
