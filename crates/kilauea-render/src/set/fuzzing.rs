//! Readers of what members of a set say to each other, for tests that feed them damaged bytes.

use super::wire::{decode_answers, decode_questions, unpack};

/// Reads questions as they come over a link.
pub fn read_questions(bytes: &[u8]) -> Result<(), String> {
    let body = unpack(bytes).map_err(|error| error.to_string())?;
    let questions = decode_questions(&body).map_err(|error| error.to_string())?;
    drop(questions);
    Ok(())
}

/// Reads answers to questions.
pub fn read_answers(questions: &[u8], bytes: &[u8]) -> Result<(), String> {
    let asked = unpack(questions).map_err(|error| error.to_string())?;
    let asked = decode_questions(&asked).map_err(|error| error.to_string())?;
    let body = unpack(bytes).map_err(|error| error.to_string())?;
    let answers = decode_answers(&asked, body.into_owned()).map_err(|error| error.to_string())?;
    drop(answers);
    Ok(())
}
