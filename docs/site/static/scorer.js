// The search of the site: pages that answer a new user's question come first, then guides, then what is generated or
// measured. The numbers below score() are those of Sphinx.
var Scorer = {
  score: ([docname, title, anchor, descr, score]) =>
    score + (/^docs\/(troubleshooting|commands)$/.test(docname) ? 30 : /^(reports|docs\/site\/reference)\/|^docs\/keys$/.test(docname) ? -10 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: {0: 15, 1: 5, 2: -5},
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
