// SPDX-License-Identifier: BSD-3-Clause
// Convex hulls by Qhull (Barber, Dobkin and Huhdanpaa 1996); see mechanics/convex_hull.hpp.
#include <fmt/format.h>
#include <libqhull_r/libqhull_r.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <type_traits>

#include "delassus/error.hpp"
#include "mechanics/convex_hull.hpp"

namespace {

using delassus::Vector3;
using Loop = std::vector<std::int32_t>;

/// One run of Qhull, which keeps what it found until the end. It writes into a text, never to the terminal.
class Qhull {
public:
    Qhull(const std::vector<Vector3>& points, const std::string& options) : stream_(open_memstream(&text_, &length_)) {
        if (stream_ == nullptr) throw delassus::InputError("there is no memory for a convex hull");
        coordinates_.reserve(3 * points.size());
        for (const Vector3& point : points) coordinates_.insert(coordinates_.end(), point.begin(), point.end());
        qh_zero(&state_, stream_);
        std::string command = "qhull " + options;
        code_ = qh_new_qhull(&state_, 3, static_cast<int>(points.size()), coordinates_.data(), False, command.data(),
                             nullptr, stream_);
        std::fflush(stream_);
    }
    ~Qhull() {
        qh_freeqhull(&state_, !qh_ALL);  // what is long; the rest lies in buffers
        int left = 0, left_bytes = 0;
        qh_memfreeshort(&state_, &left, &left_bytes);
        std::fclose(stream_);
        std::free(text_);
    }
    Qhull(const Qhull&) = delete;
    Qhull& operator=(const Qhull&) = delete;

    [[nodiscard]] int code() const { return code_; }
    /// The first line of what it says.
    [[nodiscard]] std::string message() const {
        const std::string text(text_, length_);
        return text.substr(0, text.find('\n'));
    }

    /// The boundary of each face, counter-clockwise from outside.
    [[nodiscard]] std::vector<Loop> loops() {
        std::vector<Loop> result;
        qhT* const qh = &state_;
        facetT* facet = nullptr;
        FORALLfacets {
            result.push_back(loop_of(*facet));
        }
        return result;
    }

private:
    std::int32_t number(const vertexT* vertex) { return qh_pointid(&state_, vertex->point); }

    Loop loop_of(const facetT& facet) {
        Loop loop;
        vertexT *vertex = nullptr, **vertexp = nullptr;
        if (facet.simplicial) {
            FOREACHvertex_(facet.vertices) {
                loop.push_back(number(vertex));
            }
        } else {
            std::map<std::int32_t, Loop> beside;
            ridgeT *ridge = nullptr, **ridgep = nullptr;
            FOREACHridge_(facet.ridges) {
                Loop ends;
                FOREACHvertex_(ridge->vertices) {
                    ends.push_back(number(vertex));
                }
                beside[ends.at(0)].push_back(ends.at(1));
                beside[ends.at(1)].push_back(ends.at(0));
            }
            std::int32_t before = -1, here = beside.begin()->first;
            do {
                loop.push_back(here);
                const Loop& next = beside.at(here);
                if (next.size() != 2 || loop.size() > beside.size())
                    throw delassus::InputError("Qhull has found a face whose edges are no loop");
                const std::int32_t there = next[0] == before ? next[1] : next[0];
                before = here;
                here = there;
            } while (here != loop.front());
        }
        if (area_along_normal(loop, facet.normal) < 0.0) std::reverse(loop.begin(), loop.end());
        return loop;
    }

    double area_along_normal(const Loop& loop, const coordT* normal) const {
        const auto from_first = [&](std::size_t i) {
            const double *point = &coordinates_[3 * static_cast<std::size_t>(loop[i])],
                         *first = &coordinates_[3 * static_cast<std::size_t>(loop[0])];
            return Vector3{point[0] - first[0], point[1] - first[1], point[2] - first[2]};
        };
        double sum = 0.0;
        for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
            const Vector3 a = from_first(i), b = from_first(i + 1);
            sum += normal[0] * (a[1] * b[2] - a[2] * b[1]) + normal[1] * (a[2] * b[0] - a[0] * b[2]) +
                   normal[2] * (a[0] * b[1] - a[1] * b[0]);
        }
        return sum;
    }

    char* text_ = nullptr;
    std::size_t length_ = 0;
    FILE* stream_;
    std::vector<coordT> coordinates_;
    qhT state_{};
    int code_ = 0;
};

}  // namespace

// C-0 merges what rounding leaves of a plane, C<tolerance> what the caller takes for one; Q12 lets such faces be wide.
extern "C" DELASSUS_API void delassus_convex_hull_faces(const std::vector<Vector3>& points, double tolerance,
                                                        std::vector<Loop>& faces) {
    Qhull qhull(points, fmt::format("C-0 C{} Q12", tolerance));
    if (qhull.code() == qh_ERRsingular) return;
    if (qhull.code() != qh_ERRnone)
        throw delassus::InputError(
            fmt::format("Qhull finds no convex hull of {} points: {}", points.size(), qhull.message()));
    faces = qhull.loops();
}

static_assert(std::is_same_v<decltype(&delassus_convex_hull_faces), DelassusConvexHullFaces>);
