#include "tpm/base/distributions.hpp"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace tpm::base {

double normal_quantile(double p) {
  return boost::math::quantile(boost::math::normal(), p);
}

double normal_cdf(double x) {
  return boost::math::cdf(boost::math::normal(), x);
}

double student_quantile(double p, double degrees) {
  return boost::math::quantile(boost::math::students_t(degrees), p);
}

double student_cdf(double x, double degrees) {
  using InDouble = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  return boost::math::cdf(boost::math::students_t_distribution<double, InDouble>(degrees), x);
}

double quick_student_quantile(double p, double degrees) {
  using InDouble = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  return boost::math::quantile(boost::math::students_t_distribution<double, InDouble>(degrees), p);
}

double chi_squared_quantile(double p, double degrees) {
  return boost::math::quantile(boost::math::chi_squared(degrees), p);
}

double chi_squared_tail(double x, double degrees) {
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(degrees), x));
}

double fisher_quantile(double p, double numerator_degrees, double denominator_degrees) {
  return boost::math::quantile(boost::math::fisher_f(numerator_degrees, denominator_degrees), p);
}

double fisher_tail(double x, double numerator_degrees, double denominator_degrees) {
  return boost::math::cdf(
      boost::math::complement(boost::math::fisher_f(numerator_degrees, denominator_degrees), x));
}

double binomial_density(int k, int n, double p) {
  return boost::math::pdf(boost::math::binomial(n, p), k);
}

double log_gamma(double x) {
  return boost::math::lgamma(x);
}

}  // namespace tpm::base
