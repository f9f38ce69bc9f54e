// Which law explains a recording of an indentation, and how well does the recording determine its
// parameters? Fits a CSV file with a time, a depth and a force in each row; units are read from the
// head of the file. This one was sampled every 0.25 s and only bounds the relaxation time.
//
//     fit_csv configs/oscillation_example/hold.csv
//
// Prints:
//     5 of 5 starts agree
//     k_inf = 39.81 N/m, 95 % interval 38.58 to 41.45, not told from a drift or a slow branch
//     k1    = 21.76 N/m, 95 % interval 9.086 to 30.03, identified
//     tau1  = 0.125 s, one-sided: upper limit only
#include <cstdio>
#include <tpmkit/error.hpp>
#include <tpmkit/fit.hpp>

int main(int argc, char** argv) try {
  tpm::fit::FitRequest request;
  request.law = "linear-1";  // a spring beside a Maxwell element; empty: the law is chosen
  const tpm::fit::FitSummary fit = tpm::fit::fit_recordings({argv + 1, argv + argc}, request);
  std::printf("%d of %d starts agree\n", fit.starts_agreeing, fit.starts_run);
  for (const tpm::fit::FittedParameter& p : fit.parameters) {
    if (p.nuisance) continue;
    std::printf("%-5s = %.4g %s", p.name.c_str(), p.estimate, p.unit.c_str());
    if (p.lower && p.upper) std::printf(", 95 %% interval %.4g to %.4g", *p.lower, *p.upper);
    std::string verdict(tpm::fit::verdict_name(p.verdict));
    if (p.unconfirmed) verdict = "not identified: " + p.unconfirmed->text;
    if (p.not_separable) verdict = "not told from a " + p.not_separable->text;
    std::printf(", %s\n", verdict.c_str());
  }
  if (fit.law) tpm::write_law("fitted_law.json", *fit.law);
} catch (const tpm::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
