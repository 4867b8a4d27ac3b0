//! (room of the scene stage)
