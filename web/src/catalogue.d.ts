/** Made of web/words by build/catalogue.ts. */
declare module "virtual:catalogue/*" {
  const catalogue: Readonly<Record<string, string>>;
  export default catalogue;
}
