#include "collision/qhull_triangles.hpp"

#include "engine/base/error.hpp"

#include <libqhull_r/qhull_ra.h>

#include <cstdio>
#include <memory>

namespace cairn {
namespace {

// Qhull's state for one run; frees both of its memory pools.
class QhullRun {
public:
    QhullRun() : messages_(std::tmpfile()) { qh_zero(&qh_, messages_); }
    ~QhullRun() {
        qh_freeqhull(&qh_, !qh_ALL);
        int blocks = 0, bytes = 0;
        qh_memfreeshort(&qh_, &blocks, &bytes);
        if (messages_) std::fclose(messages_);
    }
    QhullRun(const QhullRun&) = delete;
    QhullRun& operator=(const QhullRun&) = delete;

    int run(std::vector<coordT>& coordinates, const char* command) {
        std::string text(command);
        const int count = static_cast<int>(coordinates.size() / 3);
        return qh_new_qhull(&qh_, 3, count, coordinates.data(), False, text.data(), nullptr, messages_);
    }

    std::vector<std::array<int, 3>> triangles() {
        std::vector<std::array<int, 3>> out;
        for (facetT* facet = qh_.facet_list; facet && facet->next; facet = facet->next) {
            std::array<int, 3> t{};
            for (int k = 0; k < 3; ++k) t[k] = qh_pointid(&qh_, SETelemt_(facet->vertices, k, vertexT)->point);
            // Qhull lists a facet's vertices in the order of their creation and tells by a flag which way that turns.
            if (facet->toporient ^ qh_ORIENTclock) std::swap(t[0], t[1]);
            out.push_back(t);
        }
        return out;
    }

private:
    std::FILE* messages_;  // Qhull explains its failures at length; on a terminal that would be noise
    qhT qh_;
};

}  // namespace

std::vector<std::array<int, 3>> qhull_triangles(const std::vector<Vec3>& points) {
    std::vector<coordT> coordinates;
    coordinates.reserve(3 * points.size());
    for (const Vec3& p : points) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});

    // Qt: triangulated facets after Qhull's own merging. QJ: joggled input, which always succeeds, for the rare input that Qt cannot do.
    for (const char* command : {"qhull Qt Pp", "qhull QJ Pp"}) {
        QhullRun qhull;
        const int status = qhull.run(coordinates, command);
        if (status == qh_ERRnone) return qhull.triangles();
        if (status == qh_ERRsingular) return {};
    }
    throw Error("convex hull: Qhull found no hull of the " + std::to_string(points.size()) + " points");
}

}  // namespace cairn
