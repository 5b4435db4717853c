// Numbers that a step passes over, ascending and each at most once: so that what is not in the list costs nothing. Adding waits until
// merge, so that a list can be added to while it is being read. Allocates only to grow beyond its largest size so far.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn {

class ActiveList {
public:
    // Adds it with the next merge, unless it is there or waits already.
    void add(std::uint32_t number) {
        if (listed_.size() <= number) listed_.resize(number + 1, 0);
        if (listed_[number]) return;
        listed_[number] = 1;
        waiting_.push_back(number);
    }

    // Takes in what waits.
    void merge() {
        if (waiting_.empty()) return;
        std::sort(waiting_.begin(), waiting_.end());
        std::size_t old = numbers_.size(), added = waiting_.size(), to = old + added;
        numbers_.resize(to);
        while (added > 0) numbers_[--to] = old > 0 && numbers_[old - 1] > waiting_[added - 1] ? numbers_[--old] : waiting_[--added];
        waiting_.clear();
    }

    // Drops the numbers that keep(number) is false for, also those that wait.
    template <class Keep>
    void filter(Keep&& keep) {
        const auto drop = [&](std::uint32_t number) {
            if (keep(number)) return false;
            listed_[number] = 0;
            return true;
        };
        std::erase_if(numbers_, drop);
        std::erase_if(waiting_, drop);
    }

    bool contains(std::uint32_t number) const { return number < listed_.size() && listed_[number]; }
    bool is_waiting() const { return !waiting_.empty(); }
    const std::vector<std::uint32_t>& numbers() const { return numbers_; }

private:
    std::vector<std::uint32_t> numbers_, waiting_;
    std::vector<char> listed_;
};

}  // namespace cairn
