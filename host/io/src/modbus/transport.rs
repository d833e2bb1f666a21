//! A byte stream that refuses what nobody asked for.
//!
//! A serial line carries no number that ties an answer to its question: a late answer to the last question would be
//! taken for that to the next one, silently, with wrong values. So nothing may wait in the stream when a question goes
//! out. This wrapper looks just before each one, and also gives the end of the stream its right name.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// A stream of questions and answers.
#[derive(Debug)]
pub(super) struct Guarded<T> {
    inner: T,
    /// A question is on its way out: what comes in the meantime is looked at later.
    asking: bool,
}

impl<T> Guarded<T> {
    pub(super) fn new(inner: T) -> Self {
        Self { inner, asking: false }
    }
}

fn closed() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "the peer closed the connection")
}

impl<T: AsyncRead + Unpin> AsyncRead for Guarded<T> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.asking = false;
        let (before, room) = (buf.filled().len(), buf.remaining());
        ready!(Pin::new(&mut self.inner).poll_read(cx, buf))?;
        Poll::Ready(if room > 0 && buf.filled().len() == before { Err(closed()) } else { Ok(()) })
    }
}

impl<T: AsyncRead + AsyncWrite + Unpin> AsyncWrite for Guarded<T> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        if !self.asking {
            let mut space = [0; 64];
            let mut stray = ReadBuf::new(&mut space);
            match Pin::new(&mut self.inner).poll_read(cx, &mut stray) {
                Poll::Pending => self.asking = true,
                Poll::Ready(Err(error)) => return Poll::Ready(Err(error)),
                Poll::Ready(Ok(())) if stray.filled().is_empty() => return Poll::Ready(Err(closed())),
                Poll::Ready(Ok(())) => {
                    return Poll::Ready(Err(io::Error::other(
                        "bytes came that nobody had asked for, perhaps a late answer",
                    )));
                }
            }
        }
        Pin::new(&mut self.inner).poll_write(cx, buf)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    #[tokio::test]
    async fn a_question_is_refused_while_an_old_answer_waits() {
        let (near, mut far) = duplex(100);
        let mut near = Guarded::new(near);
        near.write_all(b"ask").await.unwrap();
        near.write_all(b" in parts").await.unwrap();
        let mut heard = [0; 12];
        far.read_exact(&mut heard).await.unwrap();
        far.write_all(b"answer").await.unwrap();
        near.read_exact(&mut [0; 6]).await.unwrap();
        far.write_all(b"and again").await.unwrap();
        assert_eq!(near.write_all(b"ask").await.unwrap_err().kind(), io::ErrorKind::Other);
    }

    #[tokio::test]
    async fn the_end_has_its_name() {
        let (near, far) = duplex(100);
        drop(far);
        let mut near = Guarded::new(near);
        assert_eq!(near.read(&mut [0; 6]).await.unwrap_err().to_string(), "the peer closed the connection");
        assert_eq!(near.write(b"ask").await.unwrap_err().to_string(), "the peer closed the connection");
    }
}
