//! (room of the response stage)
