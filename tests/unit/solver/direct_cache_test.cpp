// What the direct solver keeps from step to step is part of the state: its hash tells apart what the next step would.
#include "solver/direct.hpp"
#include "tests/support/catch.hpp"

using namespace cairn;

namespace {

std::uint64_t hash_of(const DirectCache& cache) {
    Hasher hasher;
    cache.add_to(hasher);
    return hasher.value();
}

// One body of mass m, factorised.
DirectCache cache_of(Real m) {
    DirectCache cache;
    cache.set_pattern(1, {});
    cache.factor.set_zero();
    cache.factor.add_diagonal(0, Mat6(m * Mat6::Identity()));
    cache.has_factor = cache.factor.factorise();
    cache.factored_active = {'a'};
    return cache;
}

}  // namespace

TEST_CASE("caches of the direct solver that would go on alike have one hash, and others have others") {
    const DirectCache one = cache_of(1);
    CHECK(hash_of(one) == hash_of(cache_of(1)));
    CHECK(hash_of(one) != hash_of(cache_of(2)));
    DirectCache other = one;
    other.disturbed = true;
    CHECK(hash_of(one) != hash_of(other));
    other = one;
    other.factored_active = {'l'};
    CHECK(hash_of(one) != hash_of(other));
    other = one;
    other.has_factor = false;
    CHECK(hash_of(one) != hash_of(other));
}
