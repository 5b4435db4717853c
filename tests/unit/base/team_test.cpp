#include "engine/base/team.hpp"
#include "tests/support/catch.hpp"

#include <vector>

using namespace cairn;

namespace {

// A team with so many helpers on threads of their own, for the life of a test.
class Helped {
public:
    explicit Helped(int helpers) : team(helpers + 1) {
        REQUIRE(team.take_lead());
        for (int k = 0; k < helpers; ++k) threads_.emplace_back([this] { team.help(); });
    }
    ~Helped() {
        team.finish();
        for (std::thread& t : threads_) t.join();
    }
    Team team;

private:
    std::vector<std::thread> threads_;
};

}  // namespace

TEST_CASE("a team does each piece once, however many help") {
    const int helpers = GENERATE(0, 1, 3);
    Helped helped(helpers);
    for (const std::size_t count : {0, 1, 7, 8, 9, 1000}) {
        CAPTURE(helpers, count);
        std::vector<int> done(count, 0);
        helped.team.for_pieces(count, 8, [&](std::size_t begin, std::size_t end, int worker) {
            if (worker < 0 || worker > helpers) done[begin] = -1000;
            for (std::size_t k = begin; k < end; ++k) ++done[k];
        });
        CHECK(done == std::vector<int>(count, 1));
    }
}

TEST_CASE("what a team has done is there for the next turn") {
    constexpr std::size_t kCount = 256;
    const auto mix = [](Team& team) {
        std::vector<std::uint64_t> a(kCount), b(kCount);
        for (std::size_t k = 0; k < kCount; ++k) a[k] = k;
        for (int turn = 0; turn < 200; ++turn) {
            team.for_pieces(kCount, 4, [&](std::size_t begin, std::size_t end, int) {
                for (std::size_t k = begin; k < end; ++k) b[k] = 3 * a[k] + a[(k + 97) % kCount];
            });
            std::swap(a, b);
        }
        return a;
    };
    Helped helped(2);
    Team alone(1);
    CHECK(mix(helped.team) == mix(alone));
}

TEST_CASE("a leader whom nobody helps gets everything done") {
    Team team(4);
    CHECK(team.take_lead());
    CHECK_FALSE(team.take_lead());
    int sum = 0;
    team.for_pieces(100, 1, [&](std::size_t begin, std::size_t, int) { sum += static_cast<int>(begin); });
    CHECK(sum == 4950);
    team.finish();
    team.help();  // too late: returns
}
