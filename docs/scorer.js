/* Score of search results: guides come before explanations, and explanations before symbols. */
var Scorer = {
  score: ([page, , , , score]) => {
    if (/^(tutorials|how-to)\//.test(page)) return score + 200;
    return /^reference\//.test(page) ? score : score + 100;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
