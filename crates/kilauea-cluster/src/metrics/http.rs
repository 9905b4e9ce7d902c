//! As much of HTTP/1.1 (RFC 9112) as it takes to be asked for one page.

/// Bytes of a request that are read, at most; its body, which there should not be, is not.
pub(super) const MAX_REQUEST_BYTES: usize = 8 << 10;

const TEXT: &str = "text/plain; charset=utf-8";
/// What Prometheus takes for its text format.
const METRICS: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The answer to the head of a request. `page` is made where it is asked for.
pub(super) fn answer(head: &[u8], page: impl FnOnce() -> String) -> Vec<u8> {
    let line = head.split(|&byte| byte == b'\r').next();
    let line = line.and_then(|line| str::from_utf8(line).ok());
    let words: Vec<&str> = line.unwrap_or_default().split(' ').collect();
    let [method, target, version] = words[..] else {
        return response("400 Bad Request", TEXT, "not a request\n", true);
    };
    if !version.starts_with("HTTP/1.") {
        return response("505 HTTP Version Not Supported", TEXT, "HTTP/1.1\n", true);
    }
    let has_body = method != "HEAD";
    if !matches!(method, "GET" | "HEAD") {
        return response("405 Method Not Allowed", TEXT, "GET or HEAD\n", true);
    }
    match target.split('?').next() {
        Some("/metrics") => response("200 OK", METRICS, &page(), has_body),
        _ => response("404 Not Found", TEXT, "see /metrics\n", has_body),
    }
}

/// The answer to a request whose head is longer than what is read.
pub(super) fn too_long() -> Vec<u8> {
    let status = "431 Request Header Fields Too Large";
    response(status, TEXT, "too long\n", true)
}

fn response(status: &str, content_type: &str, body: &str, has_body: bool) -> Vec<u8> {
    let allow = if status.starts_with("405") {
        "Allow: GET, HEAD\r\n"
    } else {
        ""
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nContent-Length: {}\r\n{allow}\
         Connection: close\r\n\r\n",
        body.len()
    );
    let body = if has_body { body } else { "" };
    [head.as_bytes(), body.as_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(head: &str) -> String {
        let answer = String::from_utf8(answer(head.as_bytes(), || "a 1\n".into())).unwrap();
        answer.lines().next().unwrap().to_owned()
    }

    #[test]
    fn one_page_and_what_is_wrong_with_other_requests() {
        let page = answer(b"GET /metrics HTTP/1.1\r\nHost: a\r\n\r\n", || {
            "a 1\n".into()
        });
        let page = String::from_utf8(page).unwrap();
        assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
        assert!(page.contains("Content-Length: 4\r\n") && page.ends_with("\r\n\r\na 1\n"));
        let head = answer(b"HEAD /metrics HTTP/1.0\r\n\r\n", || "a 1\n".into());
        assert!(head.ends_with(b"Content-Length: 4\r\nConnection: close\r\n\r\n"));
        assert_eq!(status("GET /metrics?x=1 HTTP/1.1\r\n"), "HTTP/1.1 200 OK");
        assert_eq!(status("GET / HTTP/1.1\r\n"), "HTTP/1.1 404 Not Found");
        assert_eq!(
            status("POST /metrics HTTP/1.1\r\n"),
            "HTTP/1.1 405 Method Not Allowed"
        );
        assert_eq!(status("KIL1"), "HTTP/1.1 400 Bad Request");
        assert_eq!(status(""), "HTTP/1.1 400 Bad Request");
        assert!(status("GET /metrics HTTP/2\r\n").contains("505"));
    }
}
