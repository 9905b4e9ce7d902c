//! Scenes and checks shared by the integration tests.
