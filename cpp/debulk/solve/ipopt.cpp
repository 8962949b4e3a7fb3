#include "debulk/solve/ipopt.hpp"

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>

#include <algorithm>
#include <cmath>

#include "debulk/solve/elastic.hpp"
#include "debulk/solve/ipopt_lock.hpp"

namespace debulk {
namespace {

using Ipopt::Index;
using Ipopt::Number;

Eigen::Map<const Eigen::VectorXd> view(const Number* data, Index size) {
  return {data, size};
}

// Presents a Problem to Ipopt.
class Adapter : public Ipopt::TNLP {
 public:
  Adapter(const Problem& problem, const Eigen::VectorXd& start, const Stop& stop)
      : problem_(problem),
        start_(start),
        stop_(stop),
        jacobian_(problem.jacobian_pattern()),
        hessian_(problem.hessian_pattern()),
        point_(start) {}

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian, IndexStyleEnum& style) override {
    n = problem_.variables();
    m = problem_.equalities();
    jacobian = static_cast<Index>(jacobian_.size());
    hessian = static_cast<Index>(hessian_.size());
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* c_lower, Number* c_upper) override {
    Eigen::Map<Eigen::VectorXd>(lower, n) = problem_.lower().cwiseMax(-1e20);  // Ipopt's infinity is 1e19
    std::fill(upper, upper + n, 1e20);
    std::fill(c_lower, c_lower + m, 0.0);
    std::fill(c_upper, c_upper + m, 0.0);
    return true;
  }

  bool get_starting_point(Index n, bool, Number* y, bool, Number*, Number*, Index, bool, Number*) override {
    Eigen::Map<Eigen::VectorXd>(y, n) = start_;
    return true;
  }

  bool eval_f(Index n, const Number* y, bool, Number& value) override {
    value = problem_.value(at(y, n));
    ++evaluations_;
    return std::isfinite(value);
  }

  bool eval_grad_f(Index n, const Number* y, bool, Number* out) override {
    Eigen::Map<Eigen::VectorXd> gradient(out, n);
    problem_.gradient(at(y, n), gradient);
    return gradient.allFinite();
  }

  bool eval_g(Index n, const Number* y, bool, Index m, Number* out) override {
    Eigen::Map<Eigen::VectorXd> values(out, m);
    problem_.constraints(at(y, n), values);
    return values.allFinite();
  }

  bool eval_jac_g(Index n, const Number* y, bool, Index, Index entries, Index* rows, Index* columns, Number* out) override {
    if (!out) return copy_pattern(jacobian_, rows, columns);
    Eigen::Map<Eigen::VectorXd> values(out, entries);
    problem_.jacobian(at(y, n), values);
    return values.allFinite();
  }

  bool eval_h(Index n, const Number* y, bool, Number weight, Index m, const Number* lambda, bool, Index entries, Index* rows,
              Index* columns, Number* out) override {
    if (!out) return copy_pattern(hessian_, rows, columns);
    Eigen::Map<Eigen::VectorXd> values(out, entries);
    problem_.hessian(at(y, n), weight, view(lambda, m), values);
    return values.allFinite();
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number, Number, Number, Number, Number, Index,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    iterations_ = iteration;
    return !stop_.now();
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* y, const Number*, const Number*, Index, const Number*, const Number*,
                         Number, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    final_ = view(y, n);
  }

  const Eigen::VectorXd& final_point() const { return final_.size() ? final_ : start_; }
  int iterations() const { return iterations_; }
  int evaluations() const { return evaluations_; }

 private:
  const Eigen::VectorXd& at(const Number* y, Index n) {
    point_ = view(y, n);
    return point_;
  }

  static bool copy_pattern(const std::vector<Problem::Entry>& pattern, Index* rows, Index* columns) {
    for (std::size_t k = 0; k < pattern.size(); ++k) {
      rows[k] = pattern[k].row;
      columns[k] = pattern[k].column;
    }
    return true;
  }

  const Problem& problem_;
  Eigen::VectorXd start_;
  Stop stop_;
  std::vector<Problem::Entry> jacobian_, hessian_;
  Eigen::VectorXd point_, final_;
  int iterations_ = 0;
  int evaluations_ = 0;
};

SolveStatus translate(Ipopt::ApplicationReturnStatus status, const Stop& stop) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return SolveStatus::converged;
    case Ipopt::Maximum_Iterations_Exceeded:
      return SolveStatus::iteration_limit;
    case Ipopt::User_Requested_Stop:
      return stop.cancelled() ? SolveStatus::cancelled : SolveStatus::deadline;
    default:  // includes "infeasible": with a compliance on every equality no problem is, so it can only come from rounding
      return SolveStatus::numerical_failure;
  }
}

}  // namespace

Outcome minimise_with_ipopt(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options) {
  const std::unique_lock<std::mutex> lock = ipopt_lock();

  const Elastic elastic(problem, options.stiffness);
  Ipopt::SmartPtr<Adapter> adapter = new Adapter(elastic, elastic.extend(start), options.stop);
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  application->Options()->SetStringValue("sb", "yes");
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("nlp_scaling_method", "none");  // the problem is scaled already
  application->Options()->SetStringValue("linear_solver", "mumps");
  application->Options()->SetNumericValue("tol", options.tolerance);
  application->Options()->SetNumericValue("acceptable_tol", options.tolerance);
  application->Options()->SetIntegerValue("max_iter", options.max_iterations);
  application->Options()->SetNumericValue("bound_relax_factor", 0.0);  // the ply may not sink into the mold
  application->Options()->SetStringValue("option_file_name", "");      // read no ipopt.opt from the working directory
  Outcome outcome;
  if (application->Initialize("") != Ipopt::Solve_Succeeded) {
    outcome.y = start;
    return outcome;
  }
  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(adapter);
  outcome.y = elastic.inner_part(adapter->final_point());
  outcome.status = translate(status, options.stop);
  outcome.iterations = adapter->iterations();
  outcome.evaluations = adapter->evaluations();
  return outcome;
}

}  // namespace debulk
