// Hash map from a 64-bit key to a 32-bit value: open addressing with linear probing and backward-shift deletion. No allocation while the
// number of entries does not grow; never iterated, so nothing depends on its order.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn {

class PairMap {
public:
    static constexpr std::uint32_t kNone = UINT32_MAX;

    std::uint32_t find(std::uint64_t key) const {
        if (entries_.empty()) return kNone;
        for (std::size_t i = home(key);; i = (i + 1) & mask_) {
            if (entries_[i].value == kNone) return kNone;
            if (entries_[i].key == key) return entries_[i].value;
        }
    }

    // The key must not be in the map; the value must not be kNone.
    void insert(std::uint64_t key, std::uint32_t value) {
        if (2 * (count_ + 1) > entries_.size()) grow();
        place(key, value);
        ++count_;
    }

    // Does nothing if the key is not there.
    void erase(std::uint64_t key) {
        if (entries_.empty()) return;
        std::size_t i = home(key);
        while (entries_[i].value != kNone && entries_[i].key != key) i = (i + 1) & mask_;
        if (entries_[i].value == kNone) return;
        // Moves later entries of the same run up, so that no probe ends early.
        for (std::size_t j = (i + 1) & mask_; entries_[j].value != kNone; j = (j + 1) & mask_) {
            if (((j - home(entries_[j].key)) & mask_) >= ((j - i) & mask_)) {
                entries_[i] = entries_[j];
                i = j;
            }
        }
        entries_[i].value = kNone;
        --count_;
    }

    std::size_t size() const { return count_; }

private:
    struct Entry {
        std::uint64_t key = 0;
        std::uint32_t value = kNone;
    };

    // Fibonacci hashing (Knuth 1973, 6.4).
    std::size_t home(std::uint64_t key) const { return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15u) >> 32) & mask_; }

    void place(std::uint64_t key, std::uint32_t value) {
        std::size_t i = home(key);
        while (entries_[i].value != kNone) i = (i + 1) & mask_;
        entries_[i] = {key, value};
    }

    void grow() {
        std::vector<Entry> old = std::move(entries_);
        entries_.assign(old.empty() ? 64 : 2 * old.size(), Entry{});
        mask_ = entries_.size() - 1;
        for (const Entry& e : old)
            if (e.value != kNone) place(e.key, e.value);
    }

    std::vector<Entry> entries_;
    std::size_t mask_ = 0;
    std::size_t count_ = 0;
};

}  // namespace cairn
