//! (room of the em stage)
