use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use arc_swap::{ArcSwapOption, Guard};

/// Texels of a tile, as stored.
#[derive(Debug)]
pub(crate) struct Tile(pub(crate) Box<[u8]>);

/// A tile, resident as long as it is held.
pub(crate) type HeldTile = Guard<Option<Arc<Tile>>>;

/// The resident tiles of all images: one slot per tile, emptied by the clock algorithm (second
/// chance) whenever the tiles outgrow the budget.
///
/// Bounded by `budget_bytes` plus the tile being looked at by each thread. The mutex is taken only
/// where a tile was just read, and no other lock is taken under it.
#[derive(Debug)]
pub(crate) struct TileCache {
    slots: Vec<Slot>,
    budget_bytes: u64,
    clock: Mutex<Clock>,
    /// Of those who fetch and wait for others who read the same tile.
    reading: Mutex<()>,
    has_read: Condvar,
    tiles_loaded: AtomicU64,
    tiles_fetched: AtomicU64,
    bytes_read: AtomicU64,
    lookup_wait_ns: AtomicU64,
}

#[derive(Debug, Default)]
struct Slot {
    tile: ArcSwapOption<Tile>,
    /// Used since the clock's hand last passed.
    used: AtomicBool,
    /// Somebody who fetches it reads it now.
    is_read: AtomicBool,
}

#[derive(Debug, Default)]
struct Clock {
    /// Resident slots, the hand at the front.
    resident: VecDeque<u32>,
    bytes: u64,
    bytes_peak: u64,
}

/// What a [`TextureStore`](crate::TextureStore) has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureStats {
    /// Tiles read, counting one again that was evicted in between.
    pub tiles_loaded: u64,
    /// Tiles that were there before a lookup needed them, as somebody had asked for them.
    pub tiles_fetched: u64,
    /// How long lookups waited for tiles that were not there, all threads together.
    pub lookup_wait: Duration,
    /// Bytes of texels held now.
    pub bytes_resident: u64,
    /// Most bytes of texels held at any time.
    pub bytes_peak: u64,
    /// Bytes of texels read.
    pub bytes_read: u64,
    /// Tiles of all images and mip levels.
    pub tiles_total: u64,
    /// Values of all images that were not finite.
    pub values_replaced: u64,
}

impl TileCache {
    pub(crate) fn new(n_slots: usize, budget_bytes: u64) -> Self {
        let mut slots = Vec::new();
        slots.resize_with(n_slots, Slot::default);
        Self {
            slots,
            budget_bytes,
            clock: Mutex::default(),
            reading: Mutex::default(),
            has_read: Condvar::new(),
            tiles_loaded: AtomicU64::new(0),
            tiles_fetched: AtomicU64::new(0),
            bytes_read: AtomicU64::new(0),
            lookup_wait_ns: AtomicU64::new(0),
        }
    }

    /// The tile of a slot for a lookup, which waits for `load` where it is not resident.
    #[inline]
    pub(crate) fn get(
        &self,
        slot_idx: u32,
        load: impl FnOnce() -> Option<Tile>,
    ) -> Option<HeldTile> {
        let slot = &self.slots[slot_idx as usize];
        let resident = slot.tile.load();
        if resident.is_some() {
            // Reading first keeps the cache line shared between threads.
            if !slot.used.load(Ordering::Relaxed) {
                slot.used.store(true, Ordering::Relaxed);
            }
            return Some(resident);
        }
        drop(resident);
        let start = Instant::now();
        let tile = self.load(slot_idx, load).map(|(tile, _)| tile);
        let wait_ns = start.elapsed().as_nanos() as u64;
        self.lookup_wait_ns.fetch_add(wait_ns, Ordering::Relaxed);
        tile.map(|tile| Guard::from_inner(Some(tile)))
    }

    pub(crate) fn is_resident(&self, slot_idx: u32) -> bool {
        self.slots[slot_idx as usize].tile.load().is_some()
    }

    /// Makes the tile of a slot resident ahead of lookups. Nothing happens if it is, or cannot be
    /// read. Many ask for a tile at the same time; one of them reads it, the others wait.
    pub(crate) fn fetch(&self, slot_idx: u32, load: impl FnOnce() -> Option<Tile>) {
        let slot = &self.slots[slot_idx as usize];
        let lock = || self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        let mut reading = lock();
        while slot.is_read.load(Ordering::Relaxed) {
            let woken = self.has_read.wait(reading);
            reading = woken.unwrap_or_else(PoisonError::into_inner);
        }
        if self.is_resident(slot_idx) {
            return;
        }
        slot.is_read.store(true, Ordering::Relaxed);
        drop(reading);
        if let Some((_, is_new)) = self.load(slot_idx, load) {
            self.tiles_fetched
                .fetch_add(u64::from(is_new), Ordering::Relaxed);
        }
        let _reading = lock();
        slot.is_read.store(false, Ordering::Relaxed);
        self.has_read.notify_all();
    }

    /// Makes a tile resident that came from elsewhere.
    pub(crate) fn take_in(&self, slot_idx: u32, tile: Tile) {
        if !self.is_resident(slot_idx) {
            let is_new = self.insert(slot_idx, &Arc::new(tile));
            self.tiles_fetched
                .fetch_add(u64::from(is_new), Ordering::Relaxed);
        }
    }

    /// Reads a tile, and says whether it became resident by that.
    fn load(
        &self,
        slot_idx: u32,
        load: impl FnOnce() -> Option<Tile>,
    ) -> Option<(Arc<Tile>, bool)> {
        let tile = Arc::new(load()?);
        self.tiles_loaded.fetch_add(1, Ordering::Relaxed);
        self.bytes_read
            .fetch_add(tile.0.len() as u64, Ordering::Relaxed);
        let is_new = self.insert(slot_idx, &tile);
        Some((tile, is_new))
    }

    pub(crate) fn stats(&self) -> TextureStats {
        let clock = self.clock.lock().unwrap_or_else(PoisonError::into_inner);
        TextureStats {
            tiles_loaded: self.tiles_loaded.load(Ordering::Relaxed),
            tiles_fetched: self.tiles_fetched.load(Ordering::Relaxed),
            lookup_wait: Duration::from_nanos(self.lookup_wait_ns.load(Ordering::Relaxed)),
            bytes_resident: clock.bytes,
            bytes_peak: clock.bytes_peak,
            bytes_read: self.bytes_read.load(Ordering::Relaxed),
            tiles_total: self.slots.len() as u64,
            ..TextureStats::default()
        }
    }

    /// Keeps a tile; false if it is too large, or there already.
    fn insert(&self, slot_idx: u32, tile: &Arc<Tile>) -> bool {
        let n_bytes = tile.0.len() as u64;
        if n_bytes > self.budget_bytes {
            return false;
        }
        let mut clock = self.clock.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = &self.slots[slot_idx as usize];
        // Another thread may have read the same tile meanwhile.
        if slot.tile.load().is_some() {
            return false;
        }
        self.make_room(&mut clock, n_bytes);
        slot.tile.store(Some(Arc::clone(tile)));
        slot.used.store(true, Ordering::Relaxed);
        clock.resident.push_back(slot_idx);
        clock.bytes += n_bytes;
        clock.bytes_peak = clock.bytes_peak.max(clock.bytes);
        true
    }

    /// Evicts until `n_bytes` fit; a slot used since the hand last passed gets a second chance.
    fn make_room(&self, clock: &mut Clock, n_bytes: u64) {
        // Two rounds clear every mark, unless other threads keep setting them.
        let mut chances = clock.resident.len();
        while clock.bytes + n_bytes > self.budget_bytes {
            let Some(slot_idx) = clock.resident.pop_front() else {
                return;
            };
            let slot = &self.slots[slot_idx as usize];
            if chances > 0 && slot.used.swap(false, Ordering::Relaxed) {
                chances -= 1;
                clock.resident.push_back(slot_idx);
            } else if let Some(evicted) = slot.tile.swap(None) {
                clock.bytes -= evicted.0.len() as u64;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load_10(cache: &TileCache, slot_idx: u32) -> bool {
        let mut missed = false;
        cache.get(slot_idx, || {
            missed = true;
            Some(Tile(Box::new([0; 10])))
        });
        missed
    }

    #[test]
    fn keeps_within_budget_and_prefers_tiles_in_use() {
        let cache = TileCache::new(100, 50);
        for slot_idx in 0..100 {
            assert!(load_10(&cache, slot_idx));
            // Slot 0 is touched between all loads.
            load_10(&cache, 0);
        }
        let stats = cache.stats();
        assert_eq!((stats.bytes_resident, stats.bytes_peak), (50, 50));
        assert!(!load_10(&cache, 99), "the latest is resident");
        assert!(load_10(&cache, 1), "an old one is not");
        assert!(stats.tiles_loaded < 130, "{}", stats.tiles_loaded);
    }

    #[test]
    fn a_tile_larger_than_the_budget_is_used_and_dropped() {
        let cache = TileCache::new(1, 5);
        assert!(load_10(&cache, 0) && load_10(&cache, 0));
        assert_eq!(cache.stats().bytes_peak, 0);
        assert_eq!(cache.stats().bytes_read, 20);
    }

    #[test]
    fn what_was_fetched_costs_lookups_nothing() {
        let cache = TileCache::new(3, 100);
        let tile = || Some(Tile(Box::new([7; 10])));
        cache.fetch(0, tile);
        cache.fetch(0, || unreachable!("it is resident"));
        cache.take_in(1, Tile(Box::new([8; 10])));
        cache.fetch(2, || None);
        assert!([0, 1].iter().all(|&slot_idx| cache.is_resident(slot_idx)));
        assert!(!cache.is_resident(2));
        assert!(!load_10(&cache, 0) && !load_10(&cache, 1));
        let stats = cache.stats();
        assert_eq!((stats.tiles_fetched, stats.tiles_loaded), (2, 1));
        assert_eq!(stats.lookup_wait, Duration::ZERO);
        cache.get(2, || {
            let start = Instant::now();
            while start.elapsed().is_zero() {}
            None
        });
        assert!(cache.stats().lookup_wait > Duration::ZERO);
    }

    #[test]
    fn what_many_fetch_at_once_is_read_once() {
        let cache = TileCache::new(2, 100);
        let n_read = AtomicU64::new(0);
        let read = || {
            n_read.fetch_add(1, Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(20));
            Some(Tile(Box::new([7; 10])))
        };
        std::thread::scope(|threads| {
            for slot_idx in [0, 1, 0, 1, 0, 1, 0, 1] {
                let (cache, read) = (&cache, &read);
                threads.spawn(move || {
                    cache.fetch(slot_idx, read);
                    assert!(cache.is_resident(slot_idx));
                });
            }
        });
        assert_eq!(n_read.into_inner(), 2);
        assert_eq!(cache.stats().tiles_fetched, 2);
    }

    #[test]
    fn a_failed_load_leaves_no_trace() {
        let cache = TileCache::new(1, 100);
        assert!(cache.get(0, || None).is_none());
        assert!(load_10(&cache, 0));
    }
}
