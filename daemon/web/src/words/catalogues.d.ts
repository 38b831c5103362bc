// Made of all JSON files of this folder (catalogues.mjs).
declare module "catalogues" {
  const catalogues: { en: Record<string, string> } & Record<string, Record<string, string>>;
  export default catalogues;
}
