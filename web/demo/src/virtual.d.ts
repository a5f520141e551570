declare module "virtual:methods" {
  /** Names of the methods that were there when the page was built, by body. */
  const methods: Readonly<Record<string, readonly string[]>>;
  export default methods;
}
