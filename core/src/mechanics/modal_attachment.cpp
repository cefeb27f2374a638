// SPDX-License-Identifier: BSD-3-Clause
#include "mechanics/modal_attachment.hpp"

namespace delassus::mechanics {
namespace {

/// One product of an axis of the interface with one of the body, ± ½ d · b.
struct AxisProduct {
    double factor;
    Vector3d d;       ///< d̂, in the frame of the modal body
    Matrix3Xd shape;  ///< Ψ_d
    Vector3d b;       ///< b̄, in that of the rigid body
    Vector3d b_in_frame, d_in_body;
};

/// Visits both products of each of the three rows: visit(row, product).
template <class Visitor>
void for_each_product(const ModalAttachment& one, const ModalPlacement& at, const Placement& body, Visitor&& visit) {
    const Vector3d turn = one.interface.turn * at.s;
    const Matrix3d relative = at.A.transpose() * body.A;
    for (Eigen::Index i = 0; i < 3; ++i)
        for (const double sign : {1.0, -1.0}) {
            const Eigen::Index k = sign > 0.0 ? (i + 2) % 3 : (i + 1) % 3, j = sign > 0.0 ? (i + 1) % 3 : (i + 2) % 3;
            const Vector3d e = Vector3d::Unit(k);
            AxisProduct product;
            product.factor = 0.5 * sign;
            product.d = e + turn.cross(e);
            product.shape = -skew(e) * one.interface.turn;
            product.b = one.axes.col(j);
            product.b_in_frame = relative * product.b;
            product.d_in_body = relative.transpose() * product.d;
            visit(3 + i, product);
        }
}

Vector3d velocity_of_axis(const AxisProduct& product, const ModalPlacement& at) {
    return at.A * (at.omega.cross(product.d) + product.shape * at.s_dot);
}

}  // namespace

VectorXd ModalAttachment::value(const ModalPlacement& at, const Placement& of_body) const {
    VectorXd C = VectorXd::Zero(rows());
    C.head<3>() = at.x + at.A * interface.point.at(at.s) - (of_body.x + of_body.A * arm);
    if (interface.turns())
        for_each_product(*this, at, of_body, [&](Eigen::Index row, const AxisProduct& product) {
            C[row] += product.factor * product.d.dot(product.b_in_frame);
        });
    return C;
}

MatrixXd ModalAttachment::jacobian(const ModalPlacement& at, const Placement& of_body) const {
    const auto k = at.s.size();
    MatrixXd D = MatrixXd::Zero(rows(), 12 + k);
    D.block<3, 3>(0, 0).setIdentity();
    D.block<3, 3>(0, 3) = -at.A * skew(interface.point.at(at.s));
    D.block(0, 6, 3, k) = at.A * interface.point.shape;
    D.block<3, 3>(0, 6 + k) = -Matrix3d::Identity();
    D.block<3, 3>(0, 9 + k) = of_body.A * skew(arm);
    if (interface.turns())
        for_each_product(*this, at, of_body, [&](Eigen::Index row, const AxisProduct& product) {
            D.block<1, 3>(row, 3) += product.factor * product.d.cross(product.b_in_frame).transpose();
            D.block(row, 6, 1, k) += product.factor * (product.b_in_frame.transpose() * product.shape);
            D.block<1, 3>(row, 9 + k) += product.factor * product.b.cross(product.d_in_body).transpose();
        });
    return D;
}

VectorXd ModalAttachment::rate(const ModalPlacement& at, const Placement& of_body) const {
    VectorXd C_t = VectorXd::Zero(rows());
    if (!of_body.prescribed()) return C_t;
    C_t.head<3>() = -(of_body.v + of_body.A * of_body.omega.cross(arm));
    if (interface.turns())
        for_each_product(*this, at, of_body, [&](Eigen::Index row, const AxisProduct& product) {
            C_t[row] += product.factor * product.d_in_body.dot(of_body.omega.cross(product.b));
        });
    return C_t;
}

VectorXd ModalAttachment::curvature(const ModalPlacement& at, const Placement& of_body) const {
    VectorXd c = VectorXd::Zero(rows());
    const Vector3d& w = at.omega;
    const auto second = [&](const Vector3d& d, const Matrix3Xd& shape) -> Vector3d {
        return at.A * (w.cross(w.cross(d)) + 2.0 * w.cross(shape * at.s_dot));
    };
    const auto second_of_body = [&](const Vector3d& b) -> Vector3d {
        Vector3d turning = of_body.omega.cross(of_body.omega.cross(b));
        if (of_body.prescribed()) turning += of_body.turning.cross(b);
        return of_body.A * turning;
    };
    c.head<3>() = second(interface.point.at(at.s), interface.point.shape) - second_of_body(arm);
    if (of_body.prescribed()) c.head<3>() -= of_body.acceleration;
    if (interface.turns())
        for_each_product(*this, at, of_body, [&](Eigen::Index row, const AxisProduct& product) {
            const Vector3d d = at.A * product.d, b = of_body.A * product.b;
            const Vector3d b_dot = of_body.A * of_body.omega.cross(product.b);
            c[row] += product.factor * (second(product.d, product.shape).dot(b) + d.dot(second_of_body(product.b)) +
                                        2.0 * velocity_of_axis(product, at).dot(b_dot));
        });
    return c;
}

MatrixXd ModalAttachment::stiffness(const ModalPlacement& at, const Placement& of_body, const double* lambda) const {
    const auto k = at.s.size();
    MatrixXd K = MatrixXd::Zero(12 + k, 12 + k);
    const auto add_turning = [&](const Vector3d& d, const Matrix3Xd& shape, const Vector3d& y) {
        const Matrix3d cross = skew(y);
        K.block<3, 3>(3, 3) += skew(d) * cross;
        K.block(3, 6, 3, k) -= cross * shape;
        K.block(6, 3, k, 3) += shape.transpose() * cross;
    };
    const Eigen::Map<const Vector3d> force(lambda);
    add_turning(interface.point.at(at.s), interface.point.shape, at.A.transpose() * force);
    K.block<3, 3>(9 + k, 9 + k) -= skew(arm) * skew(of_body.A.transpose() * force);
    if (!interface.turns()) return K;
    for_each_product(*this, at, of_body, [&](Eigen::Index row, const AxisProduct& product) {
        const double factor = product.factor * lambda[row];
        add_turning(product.d, product.shape, factor * product.b_in_frame);
        K.block<3, 3>(9 + k, 9 + k) += skew(product.b) * skew(factor * product.d_in_body);
        // J_dᵀ J_b and its transpose, with J_b = −B [b̄]×.
        MatrixXd of_axis(3, 3 + k);
        of_axis << -skew(product.d), product.shape;
        const Matrix3d turn_of_body = -(at.A.transpose() * of_body.A) * skew(product.b);
        const MatrixXd cross = factor * of_axis.transpose() * turn_of_body;
        K.block(3, 9 + k, 3 + k, 3) += cross;
        K.block(9 + k, 3, 3, 3 + k) += cross.transpose();
    });
    return K;
}

}  // namespace delassus::mechanics
