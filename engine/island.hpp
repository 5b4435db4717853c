// Islands: groups of dynamic bodies that constraints tie together, found by union-find (Tarjan 1975) each step.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn {

// Half-open range in one of the builder's lists.
struct IndexRange {
    int begin = 0;
    int end = 0;
};

// Deterministic: islands in the order of their lowest body, bodies and constraints of an island in ascending order.
class IslandBuilder {
public:
    // Starts over, no body in an island. `awake`: the bodies that may be, ascending, below body_count; kept by reference until finish.
    void begin(std::size_t body_count, const std::vector<std::uint32_t>& awake);
    // A constraint between two bodies; UINT32_MAX for one that cannot move. `item` is given back, `kind` keeps lists apart.
    void add(std::uint32_t body_a, std::uint32_t body_b, int kind, std::uint32_t item);
    // Groups what was added.
    void finish();

    int count() const { return static_cast<int>(islands_.size()); }
    IndexRange bodies(int island) const { return islands_[island].bodies; }
    IndexRange items(int island, int kind) const { return islands_[island].items[kind]; }
    const std::vector<std::uint32_t>& body_list() const { return body_list_; }
    const std::vector<std::uint32_t>& item_list(int kind) const { return lists_[kind].sorted; }
    // Whether a body that was awake at begin is in an island.
    bool is_member(std::uint32_t body) const { return member_[body]; }

    static constexpr int kContact = 0;
    static constexpr int kJoint = 1;

private:
    struct Island {
        IndexRange bodies;
        IndexRange items[2];
    };
    struct List {
        std::vector<std::uint32_t> item, body, sorted;
    };
    std::uint32_t root(std::uint32_t body);

    const std::vector<std::uint32_t>* awake_ = nullptr;
    std::vector<std::uint32_t> parent_;
    std::vector<char> member_;
    std::vector<int> island_of_;
    std::vector<std::uint32_t> body_list_;
    List lists_[2];
    std::vector<Island> islands_;
};

}  // namespace cairn
