/* Score of search results: guides come first, above all those whose title contains the words; then explanations, then
   symbols. */
const searched = (new URLSearchParams(location.search).get("q") || "").trim().replace(/[^\p{L}\p{N} ]/gu, "");
const asWords = searched && new RegExp(`(^|[^\\p{L}\\p{N}])${searched}($|[^\\p{L}\\p{N}])`, "iu");

var Scorer = {
  score: ([page, title, , , score]) => {
    if (/^(tutorials|how-to)\//.test(page)) return score + (asWords && asWords.test(title) ? 400 : 200);
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
