//! A number or several for each sample, told apart from other such tables without comparing them.

use std::sync::atomic::{AtomicU64, Ordering};

static NEXT: AtomicU64 = AtomicU64::new(0);

/// Values of all samples, in their order. Tables are equal where they are the same one.
#[derive(Debug)]
pub struct Table<T> {
    id: u64,
    values: Vec<T>,
}

impl<T> Table<T> {
    /// A table unlike all before it.
    pub fn new(values: Vec<T>) -> Self {
        Self { id: NEXT.fetch_add(1, Ordering::Relaxed), values }
    }

    /// No other table of this program, of whatever type, has the same.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// One for each sample.
    pub fn values(&self) -> &[T] {
        &self.values
    }
}

impl<T> PartialEq for Table<T> {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}
