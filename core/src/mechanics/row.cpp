// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/row.hpp"

#include <algorithm>
#include <cmath>

namespace delassus::mechanics {

namespace {

Vector3d value_of(const Feature& feature, const Placements& at) {
    Vector3d result = Vector3d::Zero();
    for (int k = 0; k < feature.count; ++k) {
        const Part& part = feature.parts[static_cast<std::size_t>(k)];
        const Placement& place = at[part.body];
        Vector3d vector = place.A * part.arm;
        if (part.point) vector += place.x;
        result += part.sign * vector;
    }
    return result;
}

/// A feature with what its derivatives in time need.
struct Motion3 {
    Vector3d value = Vector3d::Zero(), partial = Vector3d::Zero(), velocity = Vector3d::Zero(),
             curvature = Vector3d::Zero();
};

Motion3 evaluate(const Feature& feature, const Placements& at) {
    Motion3 result;
    for (int k = 0; k < feature.count; ++k) {
        const Part& part = feature.parts[static_cast<std::size_t>(k)];
        const Placement& place = at[part.body];
        const double l = part.point ? 1.0 : 0.0;
        const Vector3d turned = place.omega.cross(part.arm);
        const Vector3d velocity = part.sign * (l * place.v + place.A * turned);
        result.value += part.sign * (l * place.x + place.A * part.arm);
        result.velocity += velocity;
        result.curvature += part.sign * (place.A * place.omega.cross(turned));
        if (!place.prescribed()) continue;
        result.partial += velocity;
        result.curvature += part.sign * (l * place.acceleration + place.A * place.turning.cross(part.arm));
    }
    return result;
}

/// result += J_featureᵀ y.
void add_transposed(const Feature& feature, const Placements& at, const Vector3d& y, const RowColumns& columns,
                    double factor, RowVector& result) {
    for (int k = 0; k < feature.count; ++k) {
        const Part& part = feature.parts[static_cast<std::size_t>(k)];
        const Placement& place = at[part.body];
        const int first = columns.place(place.column);
        if (first < 0) continue;
        if (part.point) result.segment<3>(first) += factor * part.sign * y;
        result.segment<3>(first + 3) += factor * part.sign * part.arm.cross(place.A.transpose() * y);
    }
}

/// result += factor (∂(J_featureᵀ y)/∂q).
void add_turning(const Feature& feature, const Placements& at, const Vector3d& y, const RowColumns& columns,
                 double factor, RowMatrix& result) {
    for (int k = 0; k < feature.count; ++k) {
        const Part& part = feature.parts[static_cast<std::size_t>(k)];
        const Placement& place = at[part.body];
        const int first = columns.place(place.column) + 3;
        if (first < 3) continue;
        result.block<3, 3>(first, first) += factor * part.sign * skew(part.arm) * skew(place.A.transpose() * y);
    }
}

/// result += factor J_uᵀ J_w.
void add_product(const Feature& u, const Feature& w, const Placements& at, const RowColumns& columns, double factor,
                 RowMatrix& result) {
    for (int k = 0; k < u.count; ++k) {
        const Part& left = u.parts[static_cast<std::size_t>(k)];
        const Placement& left_place = at[left.body];
        const int row = columns.place(left_place.column);
        if (row < 0) continue;
        const Matrix3d left_turn = -left.sign * left_place.A * skew(left.arm);
        for (int j = 0; j < w.count; ++j) {
            const Part& right = w.parts[static_cast<std::size_t>(j)];
            const Placement& right_place = at[right.body];
            const int column = columns.place(right_place.column);
            if (column < 0) continue;
            const Matrix3d right_turn = -right.sign * right_place.A * skew(right.arm);
            if (left.point && right.point)
                result.block<3, 3>(row, column) += factor * left.sign * right.sign * Matrix3d::Identity();
            if (left.point) result.block<3, 3>(row, column + 3) += factor * left.sign * right_turn;
            if (right.point) result.block<3, 3>(row + 3, column) += factor * right.sign * left_turn.transpose();
            result.block<3, 3>(row + 3, column + 3) += factor * left_turn.transpose() * right_turn;
        }
    }
}

/// f, f', f'' at c.
struct Outer {
    double value, slope, second;
};

Outer outer(const Row& row, double c) {
    if (!row.length) return {row.scale * c, row.scale, 0.0};
    const double root = std::sqrt(c);
    return {root, 0.5 / root, -0.25 / (c * root)};
}

}  // namespace

RowColumns Row::columns(const Placements& at, bool with_prescribed) const {
    RowColumns result;
    const auto add = [&](BodyIndex body) {
        const auto& place = at[body];
        if (place.column >= 0 || (with_prescribed && place.prescribed())) result.add(body, place.column);
    };
    if (angle) {
        add(angle->second);
        add(angle->first);
    }
    for (const Feature* feature : {&u, &w})
        for (int k = 0; k < feature->count; ++k) add(feature->parts[static_cast<std::size_t>(k)].body);
    return result;
}

double Row::value(const Placements& at, double t) const {
    const double value = angle ? angle->value(at) : outer(*this, value_of(u, at).dot(value_of(w, at))).value;
    return value - offset - (drive ? drive->value(t) : 0.0);
}

void Row::gradient(const Placements& at, const RowColumns& columns, RowVector& result) const {
    result.setZero(6 * columns.bodies);
    if (angle) {
        for (const bool of_second : {true, false}) {
            const int first = columns.place(at[of_second ? angle->second : angle->first].column);
            if (first >= 0) result.segment<3>(first + 3) = angle->coefficients(at, of_second);
        }
        return;
    }
    const Vector3d first = value_of(u, at), second = value_of(w, at);
    const double slope = outer(*this, first.dot(second)).slope;
    add_transposed(u, at, second, columns, slope, result);
    add_transposed(w, at, first, columns, slope, result);
}

Vector3d Row::force(const Placements& at, double lambda) const {
    const Vector3d first = value_of(u, at), second = value_of(w, at);
    return lambda * outer(*this, first.dot(second)).slope * second;
}

double Row::rate(const Placements& at, double t) const {
    const double driven = drive ? drive->rate(t) : 0.0;
    if (angle) return angle->prescribed_rate(at) - driven;
    const Motion3 first = evaluate(u, at), second = evaluate(w, at);
    return outer(*this, first.value.dot(second.value)).slope *
               (first.partial.dot(second.value) + first.value.dot(second.partial)) -
           driven;
}

double Row::curvature(const Placements& at, double t) const {
    const double driven = drive ? drive->acceleration(t) : 0.0;
    if (angle) return angle->curvature(at) - driven;
    const Motion3 first = evaluate(u, at), second = evaluate(w, at);
    const Outer f = outer(*this, first.value.dot(second.value));
    const double velocity = first.velocity.dot(second.value) + first.value.dot(second.velocity);
    return f.slope * (first.curvature.dot(second.value) + 2.0 * first.velocity.dot(second.velocity) +
                      first.value.dot(second.curvature)) +
           f.second * velocity * velocity - driven;
}

void Row::hessian(const Placements& at, const RowColumns& columns, RowMatrix& result) const {
    result.setZero(6 * columns.bodies, 6 * columns.bodies);
    if (angle) {
        const int row = columns.place(at[angle->second].column);
        if (row < 0) return;
        for (const bool along_second : {true, false}) {
            const int column = columns.place(at[along_second ? angle->second : angle->first].column);
            if (column >= 0) result.block<3, 3>(row + 3, column + 3) = angle->turning(at, along_second);
        }
        return;
    }
    const Vector3d first = value_of(u, at), second = value_of(w, at);
    const Outer f = outer(*this, first.dot(second));
    add_turning(u, at, second, columns, f.slope, result);
    add_turning(w, at, first, columns, f.slope, result);
    add_product(u, w, at, columns, f.slope, result);
    add_product(w, u, at, columns, f.slope, result);
    if (f.second != 0.0) {
        RowVector inner;
        inner.setZero(6 * columns.bodies);
        add_transposed(u, at, second, columns, 1.0, inner);
        add_transposed(w, at, first, columns, 1.0, inner);
        result += f.second * inner * inner.transpose();
    }
}

void add_row_product(const RowColumns& columns, const RowVector& g, double factor, MatrixAssembler& H) {
    std::array<std::int32_t, 6 * RowColumns::most> place{};
    std::array<double, 6 * RowColumns::most> value{};
    std::array<std::size_t, RowColumns::most> order{0, 1, 2, 3};
    const auto bodies = static_cast<std::size_t>(columns.bodies);
    for (std::size_t k = 1; k < bodies; ++k)
        for (std::size_t i = k; i > 0 && columns.column[order[i]] < columns.column[order[i - 1]]; --i)
            std::swap(order[i], order[i - 1]);
    std::size_t count = 0;
    for (const std::size_t k : std::span(order).first(bodies))
        for (int i = 0; i < 6 && columns.column[k] >= 0; ++i, ++count) {
            place[count] = columns.column[k] + i;
            value[count] = g[6 * static_cast<Eigen::Index>(k) + i];
        }
    H.add_product(std::span(place).first(count), std::span(value).first(count), factor);
}

void add_local(const RowColumns& columns, const RowMatrix& matrix, double factor, Tangent tangent, MatrixAssembler& H) {
    for (int a = 0; a < columns.bodies; ++a)
        for (int b = 0; b < columns.bodies; ++b) {
            if (std::min(columns.column[static_cast<std::size_t>(a)], columns.column[static_cast<std::size_t>(b)]) < 0)
                continue;
            for (int i = 0; i < 6; ++i)
                for (int j = 0; j < 6; ++j) {
                    const double value = tangent == Tangent::Exact
                                             ? matrix(6 * a + i, 6 * b + j)
                                             : 0.5 * (matrix(6 * a + i, 6 * b + j) + matrix(6 * b + j, 6 * a + i));
                    H.add(columns.column[static_cast<std::size_t>(a)] + i,
                          columns.column[static_cast<std::size_t>(b)] + j, factor * value);
                }
        }
}

}  // namespace delassus::mechanics
